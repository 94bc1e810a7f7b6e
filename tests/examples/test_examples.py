"""Every example does what it says: on vehicles in lockstep, as ArduPilot and as PX4."""

import csv
import re
from itertools import pairwise
from math import dist

import pytest

from .conftest import EXAMPLES, WAYS, Flight


def check_first_flight(flight: Flight) -> None:
    assert flight.nearest("quad1", (4, 4, 3)) < 0.25


def check_team(flight: Flight) -> None:
    starts = {name: seen[0].place for name, seen in flight.tracks.items()}
    for kind in ("quad", "rover"):
        team = [name for name in starts if name.startswith(kind)]
        for name, neighbour in zip(team, team[1:] + team[:1], strict=True):
            assert dist(flight.end(name).place[:2], starts[neighbour][:2]) < 0.6, name
    closest = float(re.search(r"nearer than ([\d.]+) m", flight.said)[1])
    assert 0.4 < closest < 3


def check_velocity(flight: Flight) -> None:
    east, north, _ = zip(*(seen.place for seen in flight.tracks["quad1"]), strict=True)
    assert 2 < max(east) - min(east) < 4.5
    assert 2 < max(north) - min(north) < 4.5
    assert dist(flight.end("quad1").place, flight.tracks["quad1"][0].place) < 0.5


def check_follow_a_rover(flight: Flight) -> None:
    start = flight.tracks["rover1"][0].place
    corners = [(start[0] + east, start[1] + north) for east, north in ((4, 0), (4, 3), (0, 3))]
    for corner in corners:
        assert flight.nearest("rover1", corner) < 0.3
        assert flight.nearest("quad1", (*corner, 3)) < 0.7
    assert dist(flight.end("rover1").place[:2], start[:2]) < 0.5
    assert dist(flight.end("quad1").place[:2], flight.tracks["quad1"][0].place[:2]) < 0.5


def check_parameters(flight: Flight) -> None:
    slow, fast = map(float, re.findall(r"down after ([\d.]+) s", flight.said))
    assert slow > fast + 1
    airborne = [seen.place[2] > 0.3 for seen in flight.tracks["quad1"]]
    landings = sum(a and not b for a, b in pairwise(airborne))
    assert landings == 2


def check_mission(flight: Flight) -> None:
    assert "Reached" in flight.said or "mission" in flight.said.lower()
    for point in ((5, 0), (5, 4), (0, 4)):
        assert flight.nearest("quad1", point) < 2.2  # WPNAV_RADIUS is 2 m
    assert flight.reach("quad1") > 4


def check_telemetry(flight: Flight) -> None:
    with (flight.folder / "telemetry.csv").open() as file:
        rows = [*csv.DictReader(file)]
    assert len(rows) >= 30
    for row in rows:
        place = tuple(float(row[axis]) for axis in ("east", "north", "up"))
        assert flight.nearest("quad1", place) < 0.1
        assert 1.5 < dist(place[:2], (0, 0)) < 2.5
    assert re.search(r"battery: \d+ %", flight.said)
    assert "Traceback" not in flight.said


def check_when_things_go_wrong(flight: Flight) -> None:
    assert "takeoff(up=...)" in flight.said or "arm() first" in flight.said
    assert "LAND_SPED" in flight.said
    assert "did you mean" in flight.said
    assert "timed out: quad1: goto: not done after 2 s" in flight.said
    assert "the quadcopter has landed" in flight.said
    assert 0.5 < flight.reach("quad1") < 8


CHECKS = {
    "01_first_flight": check_first_flight,
    "02_team": check_team,
    "03_velocity": check_velocity,
    "04_follow_a_rover": check_follow_a_rover,
    "05_parameters": check_parameters,
    "06_mission": check_mission,
    "07_telemetry": check_telemetry,
    "08_when_things_go_wrong": check_when_things_go_wrong,
}


def test_no_example_is_forgotten():
    numbered = {path.stem for path in EXAMPLES.glob("[0-9]*.py")}
    assert numbered == set(CHECKS)
    others = {path.stem for path in EXAMPLES.glob("*.py")} - numbered
    assert others == {"fly_square"}  # tested with stock clients, in tests/e2e/test_vehicle.py


@pytest.mark.parametrize("example", CHECKS)
@pytest.mark.parametrize("way", WAYS[::-1])
def test_it_does_what_it_says(example, way, flights):
    flight = flights(example, way)
    assert flight.code == 0, flight.said
    assert flight.tracks
    CHECKS[example](flight)
    for name, seen in flight.tracks.items():
        assert not seen[-1].armed, name
        assert seen[-1].place[2] < 0.3, name
        if name == "quad1":
            assert 2.7 < flight.highest(name) < 5
