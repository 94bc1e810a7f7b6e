"""Runs of the examples: on simulated vehicles in lockstep, and on vehicle processes, watched."""

import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field
from math import dist
from pathlib import Path
from typing import NamedTuple

import pytest

from mavherd.gcs.report.truth import read_truth
from mavherd.transport.mavlink import Codec, mav
from mavherd.transport.tlog import read_tlog

from ..clients.ports import free_port

os.environ["MAVLINK20"] = "1"
from pymavlink import mavutil

EXAMPLES = Path(__file__).parents[2] / "examples"
QUAD = ("quad1", "quadcopter", 0, 0)
FLEETS = {  # name, kind, east and north of the vehicle processes that an example flies
    "02_team": [
        QUAD,
        ("quad2", "quadcopter", 5, 0),
        ("rover1", "rover", 0, 4),
        ("rover2", "rover", 5, 4),
    ],
    "04_follow_a_rover": [QUAD, ("rover1", "rover", 4, 2)],
}
WAYS = "lockstep", "ardupilot", "px4"  # the quick ones first: nobody waits for all
_AT_ONCE = 8  # they mostly wait; the machine has few cores
_PATIENCE = 60.0  # s, for a process to start or end on a machine that has other things to do
_LONGEST = 300.0  # s, one example
# Examples run by the wall clock, and one may be held up; the real PX4 would not wait for it.
_PATIENT = {"ardupilot": (), "px4": ("--param", "COM_OF_LOSS_T=5")}


class Seen(NamedTuple):
    """Where a vehicle was, m from the origin, and whether it was armed."""

    time: float
    place: tuple[float, float, float]  # east, north, up
    armed: bool


@dataclass
class Flight:
    """What an example has said, and what was seen of its vehicles by others."""

    code: int
    said: str
    folder: Path  # of the run
    tracks: dict[str, list[Seen]] = field(default_factory=dict)

    def nearest(self, name: str, place: Sequence[float]) -> float:
        """Return how near a vehicle has come to a place: (east, north) or with up."""
        return min(dist(seen.place[: len(place)], place) for seen in self.tracks[name])

    def highest(self, name: str) -> float:
        """Return how high it has been."""
        return max(seen.place[2] for seen in self.tracks[name])

    def reach(self, name: str) -> float:
        """Return how far from its start it has been, in the plane."""
        start = self.tracks[name][0].place
        return max(dist(seen.place[:2], start[:2]) for seen in self.tracks[name])

    def end(self, name: str) -> Seen:
        """Return what was seen last."""
        return self.tracks[name][-1]


class Vehicle:
    """A vehicle process, and a ground station of pymavlink that watches it."""

    def __init__(self, folder: Path, number: int, autopilot: str, wanted: tuple) -> None:
        self.name, kind, east, north = wanted
        self.seen: list[Seen] = []
        self._armed = False
        self._over = threading.Event()
        log = folder / f"{self.name}.log"
        at = free_port(socket.SOCK_DGRAM)  # with port 0 two watchers may get the same one
        self._watcher = mavutil.mavlink_connection(f"udpin:127.0.0.1:{at}", source_system=255)
        for _ in range(5):  # a port that was free may be taken when the vehicle binds it
            self.tcp, self.calls = free_port(socket.SOCK_STREAM), free_port(socket.SOCK_DGRAM)
            words = ["vehicle", kind, "--sysid", number, "--autopilot", autopilot]
            words += ["--position", f"{east},{north},0", "--tcp", self.tcp, *_PATIENT[autopilot]]
            words += ["--udpout", f"127.0.0.1:{at}", "--udpout", f"127.0.0.1:{self.calls}"]
            with log.open("w") as out:
                self._process = subprocess.Popen(
                    [sys.executable, "-m", "mavherd", *map(str, words)],
                    cwd=folder,
                    env={**os.environ, "PYTHONUNBUFFERED": "1"},
                    stdin=subprocess.DEVNULL,
                    stdout=out,
                    stderr=subprocess.STDOUT,
                )
            if self._has_started(log):
                break
        else:
            raise RuntimeError(f"no vehicle: {log.read_text()}")
        self._thread = threading.Thread(target=self._watch)
        self._thread.start()

    def end(self) -> None:
        """Watch until the last position is known, then stop both."""
        self._over.set()
        self._thread.join()
        self._watcher.close()
        self._process.send_signal(signal.SIGTERM)
        self._process.wait(_PATIENCE)

    def _has_started(self, log: Path) -> bool:
        deadline = time.monotonic() + _PATIENCE
        while self._process.poll() is None and time.monotonic() < deadline:
            if re.search(rf"tcp:127.0.0.1:{self.tcp}", log.read_text()):
                return True
            time.sleep(0.02)
        self._process.kill()
        self._process.wait()
        return False

    def _watch(self) -> None:
        told = 0.0
        while not self._over.is_set():
            m = self._watcher.recv_match(blocking=True, timeout=0.2)
            if time.monotonic() - told >= 1 and m is not None:
                told = time.monotonic()
                self._watcher.mav.heartbeat_send(6, 8, 0, 0, 4)
                if not self.seen:
                    every = mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED, 50_000, 0, 0, 0, 0, 0
                    command = mav.MAV_CMD_SET_MESSAGE_INTERVAL
                    self._watcher.mav.command_long_send(m.get_srcSystem(), 1, command, 0, *every)
            self._take(m)
        while m := self._watcher.recv_match():  # what has come until now
            self._take(m)

    def _take(self, m: object) -> None:
        match m.get_type() if m is not None else "":
            case "HEARTBEAT" if m.get_srcComponent() == mav.MAV_COMP_ID_AUTOPILOT1:
                self._armed = bool(m.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)
            case "LOCAL_POSITION_NED":
                self.seen.append(Seen(m.time_boot_ms / 1e3, (m.y, m.x, -m.z), self._armed))


def run(folder: Path, script: Path, *addresses: str) -> Flight:
    """Run a script to its end in a folder of its own."""
    done = subprocess.run(
        [sys.executable, script, *addresses],
        cwd=folder,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=_LONGEST,
        check=False,
    )
    folders = [*folder.glob("runs/*")]
    assert len(folders) == 1, done.stdout
    return Flight(done.returncode, done.stdout, folders[0])


def fly(folder: Path, example: str, way: str) -> Flight:
    """Run an example in lockstep, or on vehicles of a flight stack."""
    script = EXAMPLES / f"{example}.py"
    if way == "lockstep":
        flight = run(folder, script)
        for vehicle in sorted((flight.folder / "vehicles").iterdir()):
            flight.tracks[vehicle.name] = _truth(vehicle)
        return flight
    with ExitStack() as stack:
        vehicles = []
        for number, wanted in enumerate(FLEETS.get(example, [QUAD]), start=1):
            vehicles.append(Vehicle(folder, number, way, wanted))
            stack.callback(vehicles[-1].end)
        # Both kinds of links are used: some listen to us, some are listened to.
        if way == "px4":
            addresses = [f"tcp:127.0.0.1:{v.tcp}" for v in vehicles]
        else:
            addresses = [f"udpin:127.0.0.1:{v.calls}" for v in vehicles]
        flight = run(folder, script, *addresses)
    flight.tracks = {v.name: v.seen for v in vehicles}
    return flight


def _truth(folder: Path) -> list[Seen]:
    """Return what the physics had, and what the vehicle said at last of being armed."""
    track = read_truth(folder / "truth.bin")
    codec, armed = Codec(254), False
    for _, frame in read_tlog(folder / f"{folder.name}.tlog"):
        for m in codec.decode(frame):
            if m.get_type() == "HEARTBEAT" and m.get_srcComponent() == 1:
                armed = bool(m.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)
    places = map(tuple, track.position.tolist())
    return [Seen(t, place, armed) for t, place in zip(track.time.tolist(), places, strict=True)]


@pytest.fixture(scope="session")
def flights(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Callable[[str, str], Flight]]:
    """Run all examples that are to be tested at the same time; return what became of one."""
    wanted = {
        (way, item.callspec.params["example"]): None  # as a dict: in order
        for way in WAYS
        for item in request.session.items
        if "flights" in item.fixturenames and item.callspec.params["way"] == way
    }
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        begun: dict[tuple[str, str], Future[Flight]] = {}
        for way, example in wanted:
            folder = tmp_path_factory.mktemp(f"{way}-{example}")
            begun[way, example] = pool.submit(fly, folder, example, way)
        yield lambda example, way: begun[way, example].result()
        for future in begun.values():
            future.cancel()
