"""The snippets of docs/scripting.md run as they stand, in lockstep; its table tells the whole API."""

import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from textwrap import indent

import pytest

from mavherd.gcs.script import Fleet, Group, Vehicle

from .conftest import QUAD, run
from .conftest import Vehicle as Process

PAGE = Path(__file__).parents[2] / "docs" / "scripting.md"
TEXT = PAGE.read_text(encoding="utf-8")
SNIPPETS = re.findall(r"^```python\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
IN_THE_AIR = """
from mavherd.gcs import Fleet
with Fleet.from_scenario("one-quad", set=["team.start_sigma_m=0"]) as fleet:
    quad = fleet["quad1"]
    quad.arm()
    quad.takeoff(up=3)
"""
ADDRESSES = "udpin:127.0.0.1:14550", "udpin:0.0.0.0:14550"


def title(snippet: str) -> str:
    return re.sub(r"\W+", "-", snippet.strip().splitlines()[-1])


def whole(snippet: str) -> str:
    """Return a script: a snippet that opens no fleet speaks of one that is open."""
    return snippet if "Fleet." in snippet else IN_THE_AIR + indent(snippet, "    ")


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Run all snippets, some at the same time."""

    def run_one(number: int):
        folder, snippet = tmp_path_factory.mktemp("snippet"), whole(SNIPPETS[number])
        script = folder / "snippet.py"
        if "Fleet.connect" not in snippet:
            script.write_text(snippet)
            return run(folder, script)
        vehicle = Process(folder, 1, "ardupilot", QUAD)
        try:
            for address in ADDRESSES:
                snippet = snippet.replace(address, address[:-5] + str(vehicle.calls))
            script.write_text(snippet)
            return run(folder, script)
        finally:
            vehicle.end()

    with ThreadPoolExecutor(4) as pool:
        yield [pool.submit(run_one, number) for number in range(len(SNIPPETS))]


@pytest.mark.parametrize("number", range(len(SNIPPETS)), ids=lambda n: title(SNIPPETS[n]))
def test_it_runs(number, runs):
    flight = runs[number].result()
    assert flight.code == 0, f"{whole(SNIPPETS[number])}\n{flight.said}"


@pytest.mark.parametrize("kind", [Fleet, Vehicle, Group])
def test_the_page_tells_every_name(kind):
    table = TEXT.partition("## The API")[2]
    told = set(re.findall(r"\b[a-z_]+\b", table))
    public = {name for name in vars(kind) if not name.startswith("_")}
    assert public - told == set()
