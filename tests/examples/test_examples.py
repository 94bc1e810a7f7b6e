"""Every example does what it says: on vehicles in lockstep, as ArduPilot and as PX4."""

import csv
import json
import re
from math import dist

import pytest

from .conftest import EXAMPLES, WAYS, Flight, Seen

pytestmark = pytest.mark.timeout(600)


def check_first_flight(flight: Flight) -> None:
    assert flight.nearest("quad1", (4, 4, 3)) < 0.25


def check_team(flight: Flight) -> None:
    starts = {name: seen[0].place for name, seen in flight.tracks.items()}
    for kind in ("quad", "rover"):
        team = [name for name in starts if name.startswith(kind)]
        for name, neighbour in zip(team, team[1:] + team[:1], strict=True):
            assert dist(flight.end(name).place[:2], starts[neighbour][:2]) < 0.6, name
    closest = float(re.search(r"nearer than ([\d.]+) m", flight.said)[1])
    if was_steady(flight):  # else the law has come too late
        assert report_of(flight)["collisions"] == 0
        assert 0.6 < closest < 3


def check_velocity(flight: Flight) -> None:
    east, north, _ = zip(*(seen.place for seen in flight.tracks["quad1"]), strict=True)
    for axis in (east, north):  # 3 m; a machine with other things to do loses some of it
        assert 1 < max(axis) - min(axis) < 6
    assert dist(flight.end("quad1").place, flight.tracks["quad1"][0].place) < 0.5


def check_follow_a_rover(flight: Flight) -> None:
    start = flight.tracks["rover1"][0].place
    corners = [(start[0] + east, start[1] + north) for east, north in ((4, 0), (4, 3), (0, 3))]
    for corner in corners:
        assert flight.nearest("rover1", corner) < 0.3
        assert flight.nearest("quad1", (*corner, 3)) < 0.5
    assert dist(flight.end("rover1").place[:2], start[:2]) < 0.5
    assert dist(flight.end("quad1").place[:2], flight.tracks["quad1"][0].place[:2]) < 0.5


def check_parameters(flight: Flight) -> None:
    assert len(re.findall(r"SPEED = [\d.]+: down after [\d.]+ s", flight.said)) == 2
    slow, fast = descents(flight.tracks["quad1"])
    assert fast > 1.4 * slow


def descents(seen: list[Seen]) -> list[float]:
    """Return the speed of each landing between 2 m and 0.5 m, by the vehicle's own clock."""
    speeds, high = [], None
    for one in seen:
        if one.place[2] > 2:
            high = one
        elif one.place[2] < 0.5 and high:
            speeds.append((high.place[2] - one.place[2]) / (one.time - high.time))
            high = None
    return speeds


def check_mission(flight: Flight) -> None:
    assert re.search(r"through after \d+ s, in (GUIDED|OFFBOARD)", flight.said)
    for point in ((5, 0), (5, 4)):
        assert flight.nearest("quad1", point) < 2.2  # WPNAV_RADIUS is 2 m
    assert flight.nearest("quad1", (0, 4, 3)) < 0.3
    assert dist(flight.end("quad1").place, (0, 4, 0)) < 0.5


def check_telemetry(flight: Flight) -> None:
    with (flight.folder / "telemetry.csv").open() as file:
        rows = [*csv.DictReader(file)]
    assert rows
    for row in rows:
        place = tuple(float(row[axis]) for axis in ("east", "north", "up"))
        assert flight.nearest("quad1", place) < 0.1
        if was_steady(flight):  # else it has cut the circle short to catch up
            assert 1 < dist(place[:2], (0, 0)) < 3
    if was_steady(flight):
        assert len(rows) >= 20
    assert re.search(r"battery: \d+ %", flight.said)
    assert "Traceback" not in flight.said


def check_when_things_go_wrong(flight: Flight) -> None:
    assert "takeoff(up=...)" in flight.said or "arm() first" in flight.said
    assert "LAND_SPED" in flight.said
    assert "did you mean" in flight.said
    assert "timed out: quad1: goto: not done after 2 s" in flight.said
    assert "the quadcopter has landed" in flight.said
    assert 0.5 < flight.reach("quad1") < 8


def report_of(flight: Flight) -> dict:
    return json.loads((flight.folder / "report.json").read_text())


def was_steady(flight: Flight) -> bool:
    """Return whether setpoints kept coming: what has other things to do holds up no lockstep."""
    report = report_of(flight)
    few = report["late_ticks"] < 0.1 * report["ticks"]
    return report["lockstep"] or (few and report["fleet"]["setpoint_longest_gap_s"] < 0.5)


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
    assert numbered == {*CHECKS, "09_data"}  # which flies nobody: tests/examples/test_data.py
    others = {path.stem for path in EXAMPLES.glob("*.py")} - numbered
    assert others == {"fly_square"}  # tested with stock clients, in tests/e2e/test_vehicle.py


@pytest.mark.parametrize("example", CHECKS)
@pytest.mark.parametrize("way", WAYS)
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
