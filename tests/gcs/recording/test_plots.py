"""The plots hold what the robots did beside what they were asked, and what matters of a team."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("rerun")

from mavherd.gcs.recording.scene import Scene
from mavherd.gcs.recording.stage import FEW, MANY, Stage, StagedRobot
from mavherd.gcs.recording.stream import Stream
from mavherd.transport.frames import Origin, quaternion_from_euler
from mavherd.transport.wire import Phase, Target, VehicleState

STILL = (0.0, 0.0, 0.0)
LEVEL = (1.0, 0.0, 0.0, 0.0)


@pytest.fixture
def record(tmp_path, strict, read_back):
    """Record a scene of `kinds` by name, under a law, as `fill` tells it; read it back."""

    def make(kinds, fill, law="safe", selected=()):
        robots = tuple(
            StagedRobot(name, kind, i, STILL) for i, (name, kind) in enumerate(kinds.items(), 1)
        )
        stream = Stream("plots", file=tmp_path / "run.rrd")
        scene = Scene(stream, Stage("plots", law, robots, Origin()), selected)
        fill(scene)
        scene.flush(everything=True)
        stream.close()
        return read_back(tmp_path / "run.rrd")

    return make


def target(name, time, place, push=STILL, asked=STILL):
    return Target(name, time, place, STILL, asked, push)


def state(name, time, phase=Phase.ACTIVE):
    return VehicleState(name, 1, 0, time, STILL, STILL, LEVEL, 4, True, phase)


def numbers(seen, entity, component="Scalars:scalars"):
    """Return times and a table of values."""
    rows = [row for row in seen[entity][component] if row[1]]
    return np.array([t for t, _ in rows]), np.array([v for _, v in rows])


def east(speed):
    return lambda t: (speed * t, 0.0, 2.0)


def test_distance_is_that_from_where_the_robot_should_be_at_the_same_time(record, track):
    def fill(scene):
        flown = track("q", "quadcopter", 1, east(1.0), 5.0)
        for k in range(51):  # targets at 10 Hz are 0.3 m ahead and 0.4 m higher
            scene.add_targets([target("q", k / 10, (k / 10 + 0.3, 0.0, 2.4), asked=(1.5, 0, 0))])
        scene.add_truth(flown)
        scene.flush()

    seen = record({"q": "quadcopter"}, fill)
    time, distance = numbers(seen, "/plots/q", "plot:distance")
    assert time == pytest.approx(np.arange(101) / 20)
    assert distance == pytest.approx(np.full((101, 1), 0.5), abs=1e-5)
    assert numbers(seen, "/plots/q", "plot:offset")[1][50] == pytest.approx([-0.3, 0, -0.4])
    assert numbers(seen, "/plots/q", "plot:speed")[1][50] == pytest.approx([1.0])
    assert numbers(seen, "/plots/q", "plot:speed_asked")[1][50] == pytest.approx([1.5])
    assert numbers(seen, "/plots/q", "plot:height")[1][50] == pytest.approx([2.0, 2.4])


def test_without_targets_there_is_no_distance_and_the_rest_does_not_wait_for_ever(record, track):
    def fill(scene):
        scene.add_truth(track("q", "quadcopter", 1, east(1.0), 5.0))

    seen = record({"q": "quadcopter"}, fill)
    assert np.isnan(numbers(seen, "/plots/q", "plot:distance")[1]).all()
    assert len(numbers(seen, "/plots/q", "plot:speed")[1]) == 101


def test_a_target_that_is_long_past_says_nothing_of_now(record, track):
    def fill(scene):
        scene.add_targets([target("q", 1.0, (1.0, 0.0, 2.0)), target("q", 3.0, (3.0, 0.0, 2.0))])
        scene.add_truth(track("q", "quadcopter", 1, east(1.0), 5.0))

    time, distance = numbers(record({"q": "quadcopter"}, fill), "/plots/q", "plot:distance")
    known = np.isfinite(distance[:, 0])
    assert time[known] == pytest.approx(np.r_[np.arange(20, 30), np.arange(60, 70)] / 20)


def test_truth_that_comes_in_pieces_is_recorded_once_and_whole(record, track):
    def fill(scene):
        whole = track("q", "quadcopter", 1, east(1.0), 5.0)
        for a, b in ((0, 3), (3, 250), (250, 251), (251, 501)):
            columns = ("time", "position", "velocity", "quaternion", "rates", "actuators")
            part = {name: getattr(whole, name)[a:b] for name in columns}
            scene.add_truth(replace(whole, **part, commands=whole.commands[a:b]))
            scene.flush(everything=True)

    time, _ = numbers(record({"q": "quadcopter"}, fill), "/plots/q", "plot:speed")
    assert time == pytest.approx(np.arange(101) / 20)


def test_an_attitude_is_shown_in_degrees_beside_the_one_asked_for(record, track, commanded):
    def fill(scene):
        level = track("q", "quadcopter", 1, east(0.0), 1.0)
        turned = quaternion_from_euler(*np.radians([10.0, -20.0, 170.0]))  # FLU: nose up
        asked = {
            "roll_command_rad": np.radians(12.0),
            "pitch_command_rad": np.radians(-25.0),
            "yaw_command_rad": np.radians(-175.0),
            "thrust_command_n": 15.0,
        }
        rotors = {f"rotor{n}_speed_rad_s": 100.0 * n for n in range(1, 5)}
        rotors |= {f"rotor{n}_command_rad_s": 100.0 * n + 1 for n in range(1, 5)}
        flown = replace(level, quaternion=np.tile(turned, (len(level), 1)))
        scene.add_truth(commanded(flown, rotors, asked))

    seen = record({"q": "quadcopter"}, fill)
    attitude = numbers(seen, "/plots/q", "plot:attitude")[1][0]
    assert attitude == pytest.approx([10, 20, 12, 25], abs=1e-4)
    heading = numbers(seen, "/plots/q", "plot:heading")[1][0]
    assert heading == pytest.approx([170, 185], abs=1e-3)  # the short way round, without a jump
    rotors = numbers(seen, "/plots/q", "plot:rotors")[1][0]
    assert rotors == pytest.approx([100, 200, 300, 400, 101, 201, 301, 401])


def test_a_rovers_wheels_and_turn_are_beside_what_is_asked_of_them(record, track, commanded):
    def fill(scene):
        driven = track("r", "rover", 1, lambda t: (t, 0.0, 0.0), 1.0)  # turns by -0.3 rad/s
        wheels = {
            "left_wheel_speed_rad_s": 1.0,
            "right_wheel_speed_rad_s": 2.0,
            "left_wheel_command_rad_s": 3.0,
            "right_wheel_command_rad_s": 4.0,
        }
        asked = {"speed_command_m_s": 0.7, "yaw_rate_command_rad_s": 0.5}
        scene.add_truth(commanded(driven, wheels, asked))

    seen = record({"r": "rover"}, fill)
    assert numbers(seen, "/plots/r", "plot:wheels")[1][0] == pytest.approx([1, 2, 3, 4])
    assert numbers(seen, "/plots/r", "plot:turn")[1][0] == pytest.approx(np.degrees([-0.3, 0.5]))
    assert numbers(seen, "/plots/r", "plot:speed_asked")[1][0] == pytest.approx(
        [np.nan, 0.7], nan_ok=True
    )


def test_a_teams_smallest_separation_stands_beside_the_distance_of_contact(record, track):
    def fill(scene):
        scene.add_truth(track("a", "rover", 1, lambda t: (t, 0.0, 0.0), 5.0))
        scene.add_truth(track("b", "rover", 2, lambda t: (10.0 - t, 0.0, 0.0), 5.0))

    seen = record({"a": "rover", "b": "rover"}, fill)
    time, rows = numbers(seen, "/fleet/separation/rover-rover")
    assert rows[:, 0] == pytest.approx(10.0 - 2 * time)
    assert set(rows[:, 1].round(6)) == {0.79}
    (touched, (line,)), *_ = seen["/events"]["TextLog:text"]
    assert line.startswith("a and b touch")
    assert touched == pytest.approx((10 - 0.79) / 2, abs=0.06)


def test_a_late_robot_brings_its_class_of_pairs(record, track):
    def fill(scene):
        for name in ("a", "b"):
            scene.add_robot(StagedRobot(name, "quadcopter", 1, STILL))
        scene.add_truth(track("a", "quadcopter", 1, lambda t: (0 * t, 0.0, 0.0), 2.0))
        scene.add_truth(track("b", "quadcopter", 2, lambda t: (0 * t, 3.0, 4.0), 2.0))

    seen = record({}, fill, law="")
    assert numbers(seen, "/fleet/separation/quadcopter-quadcopter")[1][-1] == pytest.approx(
        [5, 0.4]
    )
    assert "/fleet/ages" not in {e for e in seen if numbers_in(seen[e])}


def numbers_in(parts):
    return "Scalars:scalars" in parts


def test_what_is_known_ages_until_the_next_state_comes(record):
    def fill(scene):
        scene.add_states([state("a", 0.95), state("b", 0.4)], 1.0)
        scene.add_states([state("b", 1.05)], 1.1)
        scene.add_clock(1.0, 2.5)

    seen = record({"a": "rover", "b": "rover"}, fill)
    time, ages = numbers(seen, "/fleet/ages")
    assert time == pytest.approx([1.0, 1.1])
    assert ages == pytest.approx(np.array([[0.05, 0.6], [np.nan, 0.05]]), nan_ok=True)
    assert numbers(seen, "/fleet/factor")[1] == pytest.approx(2.5)


def test_of_a_crowd_the_most_the_ninth_tenth_and_the_median_are_shown(record, track):
    many = {f"r{i}": "rover" for i in range(MANY + 1)}
    count = len(many)

    def fill(scene):
        for i, name in enumerate(many):
            scene.add_truth(track(name, "rover", i + 1, lambda t, i=i: (0.1 * i * t, 0, 0), 2.0))
        for k in range(21):
            t = k / 10
            far = [target(n, t, (0.1 * i * t, i, 0), (0.01 * i, 0, 0)) for i, n in enumerate(many)]
            scene.add_targets(far)
            scene.add_states([state(n, t - 0.01 * i) for i, n in enumerate(many)], t)

    seen = record(many, fill, selected=("r7",))
    assert numbers(seen, "/fleet/distance")[1][20] == pytest.approx([30, 27, 15])
    assert numbers(seen, "/fleet/speed")[1][20] == pytest.approx([3.0, 2.7, 1.5])
    assert numbers(seen, "/fleet/feed_forward")[1][10] == pytest.approx([0.3, 0.27, 0.15])
    assert numbers(seen, "/fleet/ages")[1][10] == pytest.approx([0.3, 0.27, 0.15])
    time, distance = numbers(seen, "/fleet/each", "plot:distance")
    assert time == pytest.approx(np.arange(11) / 5)
    assert distance[5] == pytest.approx(np.arange(count))
    assert [e for e in seen if e.startswith("/plots/")] == ["/plots/r7"]
    phases = numbers(seen, "/fleet/phases")[1]
    assert phases.tolist() == [[count * (p == Phase.ACTIVE) for p in Phase]]


def test_between_few_and_many_there_are_plots_of_each_and_of_all(record, track):
    some = {f"q{i}": "quadcopter" for i in range(FEW + 1)}

    def fill(scene):
        for i, name in enumerate(some):
            scene.add_truth(track(name, "quadcopter", i + 1, lambda t, i=i: (i * t, 0, 2), 1.0))

    seen = record(some, fill)
    assert numbers(seen, "/fleet/speed")[1][5] == pytest.approx([12, 11, 6])
    assert numbers(seen, "/plots/q12", "plot:speed")[1][5] == pytest.approx([12])
