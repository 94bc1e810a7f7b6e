"""External vehicles whose coordinator was killed: the user is told which, and what they do."""

import pytest

from mavherd.gcs.safety.abandoned import complaint, fate, may_be_armed
from mavherd.scenarios.schema import Point, RobotSpec


def spec(name, autopilot="ardupilot"):
    kind = "quadcopter" if name.startswith("quad") else "rover"
    return RobotSpec(name=name, kind=kind, system_id=1, start=Point(0, 0), autopilot=autopilot)


@pytest.mark.parametrize(
    ("phase", "may"),
    [(None, False), ("waiting", False), ("starting", True), ("landing", True), ("done", False)],
)
def test_who_was_under_way_may_be_armed(phase, may):
    assert may_be_armed(phase) == may


def test_nobody_is_nothing_to_tell():
    assert complaint([]) == ""


def test_a_mixed_team_is_told_in_one_line():
    text = complaint([spec("quad1"), spec("quad2", "px4"), spec("rover1")])
    assert text.startswith("nobody steers quad1, quad2, rover1 any more, may be flying, armed (")
    assert text.count("ArduPilot stops after 3 s") == text.count("PX4 fails safe") == 1
    assert text.endswith("(MAVProxy: `mode LAND`, rovers `mode HOLD` and `disarm`)")


def test_a_rover_does_not_fly():
    text = complaint([spec("rover1", "px4")])
    assert "flying" not in text
    assert "ArduPilot" not in text
    assert text.endswith("(MAVProxy: `mode HOLD` and `disarm`)")


def test_a_px4_may_come_down_where_it_is():
    assert "returns, lands, or as COM_OBL_RC_ACT says" in complaint([spec("quad1", "px4")])


def test_of_an_unknown_flight_stack_both_are_told():
    assert "ArduPilot stops" in fate(spec("quad1", "auto"))
    assert "PX4 fails safe" in fate(spec("quad1", "auto"))
