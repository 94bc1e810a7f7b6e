"""How many runs of crossing-targets a sweep gets done in a second, in-process and as processes."""

import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from typing import NamedTuple

from mavherd.gcs.run.in_process import simulate
from mavherd.scenarios.loader import load_scenario

SCENARIO = "crossing-targets"


class Rate(NamedTuple):
    """Of a sweep on all cores."""

    runs_per_s: float
    simulated_s_per_s: float


def cores() -> int:
    """Return how many runs go on at a time."""
    return len(os.sched_getaffinity(0))


def one_run(seed: int = 0) -> tuple[float, float]:
    """Return wall and simulated seconds of a run in this process, from start to verdict."""
    scenario = replace(load_scenario(SCENARIO), seed=seed)
    begun = time.perf_counter()
    report = simulate(scenario).report
    return time.perf_counter() - begun, report["duration_s"]


def bare_loops(runs: int) -> float:
    """Return runs a second of a bare loop on each core: the floor of a sweep's engine."""
    with ProcessPoolExecutor(cores(), mp_context=get_context("fork")) as pool:
        list(pool.map(one_run, range(2 * cores())))  # warm
        begun = time.perf_counter()
        list(pool.map(_several, [runs // cores()] * cores()))
        return runs // cores() * cores() / (time.perf_counter() - begun)


def sweep(few: int, many: int, *options: str) -> float:
    """Return runs a second of `mavherd sweep`, without its start and its summary."""
    return (many - few) / (_sweep_s(many, options) - _sweep_s(few, options))


def _several(runs: int) -> None:
    for seed in range(runs):
        one_run(seed)


def _sweep_s(runs: int, options: tuple[str, ...]) -> float:
    command = [sys.executable, "-m", "mavherd", "sweep", SCENARIO, "--seeds", f"0:{runs}"]
    with tempfile.TemporaryDirectory() as folder:
        begun = time.perf_counter()
        subprocess.run(
            [*command, "--jobs", str(cores()), *options],
            cwd=folder,
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        return time.perf_counter() - begun
