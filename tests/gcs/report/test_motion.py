"""Way, effort and deadlock are what a pencil makes of simple motions."""

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from mavherd.gcs.report.judge import judge
from mavherd.scenarios.schema import Goto, Hold, Point, RobotSpec, Scenario, Waypoints
from mavherd.vehicles.quadcopter import QuadcopterParams


def robot(name, kind, system_id, path):
    return RobotSpec(name=name, kind=kind, system_id=system_id, start=Point(0, 0), path=path)


def verdict_on(specs, tracks, ended_at=20.0):
    return judge(Scenario(name="test", robots=tuple(specs)), tuple(specs), tracks, 0.0, ended_at)


def only(track, way, path=None, kind="rover", **changes):
    """Return what is measured of one robot that goes `way` from where it starts."""
    spec = robot("a", kind, 1, path or Goto(target=Point(10, 0)))
    (result,) = verdict_on([spec], [replace(track("a", kind, 1, way), **changes)]).robots
    return result


def stop_and_go(*waits):
    """Drive east at 1 m/s, but for each of `waits`: when it begins and ends."""

    def way(t):
        stood = sum(np.clip(t - begin, 0, end - begin) for begin, end in waits)
        return t - stood, 0.0, 0.0

    return way


def test_effort_is_the_integral_of_acceleration_squared(track):
    result = only(track, lambda t: (0.05 * t * t, 0.0, 0.0))  # 0.1 m/s^2 all the way
    assert result.effort_rms == pytest.approx(0.1)
    arrival = math.sqrt((10 - 0.2) / 0.05)
    assert result.effort == pytest.approx(0.1**2 * arrival, rel=0.01)


def test_effort_in_a_circle_is_the_centripetal_acceleration(track):
    speed, radius = 0.5, 2.0
    circle = partial(lambda w, t: (radius * np.cos(w * t), radius * np.sin(w * t), 0.0), speed / 2)
    assert only(track, circle).effort_rms == pytest.approx(speed**2 / radius, rel=1e-3)


def test_neither_steady_motion_nor_climbing_is_an_effort(track):
    for way in (lambda t: (0.4 * t, 0.3 * t, 0.0), lambda t: (t, 0.0, 0.1 * t * t)):
        result = only(track, way, Goto(target=Point(90, 0, 5)), "quadcopter")
        assert result.effort == pytest.approx(0, abs=1e-12)


def test_telemetry_has_no_effort(track):
    result = only(track, lambda t: (0.05 * t * t, 0.0, 0.0), source="telemetry")
    assert (result.effort, result.effort_rms) == (None, None)
    assert result.arrived


def test_wheels_count_from_rest_and_rotors_from_hovering(track):
    hover = math.sqrt(QuadcopterParams().weight / 4 / QuadcopterParams().thrust_coefficient)
    for kind, columns, rest in (
        ("rover", ("left_wheel_speed_rad_s", "left_wheel_command_rad_s"), 0.0),
        ("quadcopter", ("rotor1_speed_rad_s", "rotor1_command_rad_s"), hover),
    ):
        name = {"actuator_names": columns}
        asked = np.resize([rest - 3.0, rest + 3.0], 2001)
        table = {"actuators": np.column_stack([np.full(2001, 99.0), asked])}
        result = only(track, stop_and_go(), kind=kind, **name, **table)
        assert result.actuator_rms == pytest.approx(3.0)
    assert only(track, stop_and_go()).actuator_rms is None  # its log has no commands


def test_what_comes_after_arrival_is_no_way_and_no_effort(track):
    def onward(t):  # and back, wildly
        return np.where(t < 12, t, 12 - 50 * (t - 12) ** 2), 0.0, 0.0

    result = only(track, onward)
    assert result.length == pytest.approx(9.8)
    assert result.planned == pytest.approx(10)
    assert result.path_ratio == pytest.approx(1)
    assert result.effort == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(
    ("waits", "seconds"),
    [
        ([], 0.0),
        ([(3, 4)], 0.0),  # a stop, no standstill
        ([(3, 8)], 5.0),
        ([(3, 6), (8, 11.5)], 6.5),
    ],
)
def test_who_stands_short_of_its_target_is_in_deadlock(track, waits, seconds):
    for kind in ("rover", "quadcopter"):
        result = only(track, stop_and_go(*waits), kind=kind)
        # Of each stop, at 1 m/s, the 0.1 m that count as none are 0.1 s before it and after it.
        assert result.deadlock == pytest.approx(seconds, abs=0.25 * len(waits))


def test_who_has_arrived_may_stand(track):
    assert only(track, lambda t: (np.minimum(t, 10), 0.0, 0.0)).deadlock == 0
    never = only(track, lambda t: (np.minimum(t, 9.7), 0.0, 0.0))
    assert never.deadlock == pytest.approx(20 - 9.7, abs=0.15)


def test_who_turns_on_the_spot_does_not_stand_unless_it_flies(track):
    angle = np.linspace(0, 20 * 0.5, 2001)  # half a radian a second
    zero = np.zeros_like(angle)
    turning = np.column_stack([np.cos(angle / 2), zero, zero, np.sin(angle / 2)])
    stands = only(track, stop_and_go((3, 8)), quaternion=turning)
    assert stands.deadlock == 0
    hovers = only(track, stop_and_go((3, 8)), kind="quadcopter", quaternion=turning)
    assert hovers.deadlock == pytest.approx(5, abs=0.21)
    unknown = only(track, stop_and_go((3, 8)), quaternion=np.full((2001, 4), np.nan))
    assert unknown.deadlock is None


def test_who_stays_behind_its_path_is_in_deadlock_until_the_path_ends(track):
    path = Waypoints(points=(Point(0, 0), Point(10, 0)), speed=1.0)
    blocked = only(track, lambda t: (np.minimum(t, 4), 0.0, 0.0), path)
    assert blocked.deadlock == pytest.approx(10 - 4.5, abs=0.06)  # 0.5 m behind at 4.5 s
    assert only(track, lambda t: (np.minimum(t, 10), 0.0, 0.0), path).deadlock == 0


def test_a_path_has_a_way_ratio_and_tracking_on_each_axis(track):
    path = Waypoints(points=(Point(0, 0), Point(8, 0)), speed=1.0)
    result = only(track, lambda t: (np.minimum(t, 8), 0.3, 0.0), path)
    assert result.planned == pytest.approx(8)
    assert result.path_ratio == pytest.approx(1)
    assert result.tracking.axes == pytest.approx((0, 0.3, 0), abs=1e-9)
    assert result.tracking.greatest == pytest.approx(0.3)


def test_who_holds_where_it_stands_cannot_be_in_deadlock(track):
    assert only(track, lambda t: (0 * t, 0.0, 0.0), Hold(at=Point(0, 0))).deadlock is None


def test_the_fleet_stands_when_all_do_that_still_have_to_go(track):
    specs = [
        robot("a", "rover", 1, Goto(target=Point(10, 0))),
        robot("b", "rover", 2, Goto(target=Point(10, 50))),
        robot("h", "rover", 3, Hold(at=Point(0, 0))),
    ]
    ways = {  # a stands from 3 to 9 s, b from 5 to 13; b is there at 6 s without
        "a": stop_and_go((3, 9)),
        "b": lambda t: (stop_and_go((5, 13))(t)[0], 50.0, 0.0),
        "h": lambda t: (0 * t, 90.0, 0.0),
    }
    tracks = [track(spec.name, "rover", spec.system_id, ways[spec.name], 30.0) for spec in specs]
    verdict = verdict_on(specs, tracks, 30.0)
    assert verdict.standstill.any_s == pytest.approx(10, abs=0.3)
    assert verdict.standstill.all_s == pytest.approx(4, abs=0.3)
    early = judge(Scenario(name="t", robots=tuple(specs)), tuple(specs), tracks, None, 30.0)
    assert early.standstill is None
