"""What the world shows is in the recording: read back with Rerun's own reader."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("rerun")

from mavherd.gcs.recording.colours import CLEARANCE, STALE
from mavherd.gcs.recording.stage import MANY, Stage, StagedRobot
from mavherd.gcs.recording.stream import Stream
from mavherd.gcs.recording.world import World
from mavherd.gcs.report.truth import Track
from mavherd.scenarios.schema import Fence
from mavherd.transport.frames import Origin
from mavherd.transport.wire import Phase, Target, VehicleState

STILL = (0.0, 0.0, 0.0)
LEVEL = (1.0, 0.0, 0.0, 0.0)
ORIGIN = Origin(lat_deg=-33.0, lon_deg=179.9999, alt_m=10.0)
ROTORS = tuple(f"rotor{i}_speed_rad_s" for i in range(1, 5))


@pytest.fixture(scope="module", autouse=True)
def strict():
    """Whatever Rerun would only warn of is an error here."""
    import rerun as rr

    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


def fly(name, kind, system_id, way, seconds, names=(), speeds=()):
    """Return a track at 100 Hz along `way` (time -> east, north, up), level, facing east."""
    time = np.arange(round(seconds * 100)) / 100
    position = np.stack([np.broadcast_to(np.asarray(v, float), time.shape) for v in way(time)], 1)
    velocity = np.gradient(position, 0.01, axis=0)
    n = len(time)
    quaternion, rates = np.tile(LEVEL, (n, 1)), np.zeros((n, 3))
    actuators = np.tile(np.array(speeds, float).reshape(1, -1), (n, 1))
    fields = (time, position, velocity, quaternion, rates, actuators, tuple(names))
    return Track(name, kind, system_id, (), *fields)


def believe(name, time, position):
    return VehicleState(name, 1, 0, time, position, STILL, LEVEL, 4, True, Phase.ACTIVE)


def colours_of(robots):
    return {robot.name: "#0072B2" for robot in robots}


def read(path):
    """Return entity -> component -> [(time or None, value)] of a recording."""
    from rerun.chunk import RrdReader

    found = {}
    for chunk in RrdReader(path).stream():
        rows = chunk.to_record_batch()
        times = [None] * rows.num_rows
        if "sim_time" in chunk.timeline_names:
            times = [t.value / 1e9 for t in rows["sim_time"]]
        for name in rows.schema.names:
            if ":" in name:
                entity = found.setdefault(chunk.entity_path, {})
                values = zip(times, rows[name].to_pylist(), strict=True)
                entity.setdefault(name.split(":")[1], []).extend(values)
    return found


def by_time(component):
    return dict(component)


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """Two rovers that run into each other, a quadcopter with rotors, and a late plane."""
    path = tmp_path_factory.mktemp("small") / "run.rrd"
    robots = (
        StagedRobot("trails", "rover", 1, (0, 0, 0), (9, 0, 0), ((0, 0, 0), (9, 0, 0))),
        StagedRobot("r2", "rover", 2, (4, 0, 0)),
        StagedRobot("q3", "quadcopter", 3, (0, 3, 0), (0, 3, 2)),
    )
    fence = Fence(east=(-5, 15), north=(-5, 5), up=4)
    stage = Stage("small", "paper", robots, ORIGIN, fence)
    stream = Stream("small", file=path)
    world = World(stream, stage, colours_of(robots))
    late = StagedRobot("p4", "plane", 4, (0, 9, 5))
    world.add_robot(late, "#444444")
    tracks = [
        fly("trails", "rover", 1, lambda t: (0.5 * t, 0 * t, 0 * t), 10.0),
        fly("r2", "rover", 2, lambda t: (4, 0, 0), 10.0),
        fly("q3", "quadcopter", 3, lambda t: (0, 3, np.minimum(t, 2)), 10.0, ROTORS, [600] * 4),
        fly("p4", "plane", 4, lambda t: (t, 9, 5), 10.0),
    ]
    for begin in range(0, 1000, 50):
        for track in tracks:
            names = ("time", "position", "velocity", "quaternion", "rates", "actuators")
            rows = {name: getattr(track, name)[begin : begin + 50] for name in names}
            world.add_truth(replace(track, **rows))
        for tick in range(10):
            now = begin / 100 + tick / 20
            seen = min(now, 5.0)  # r2 falls silent
            states = [believe("trails", now - 0.1, (0.5 * now, 0.1, 0)), believe("r2", seen, STILL)]
            world.add_states(states, now)
            push = (0.0, 0.4, 0.0) if 3 <= now < 4 else STILL
            aim = (9.0, 0.0, 0.0) if now < 6 else (np.nan,) * 3
            world.add_targets([Target("trails", now, aim, STILL, STILL, push)])
        world.flush()
    world.flush(everything=True)
    stream.close()
    return read(path)


def test_pose_and_attitude_are_recorded_apart(small):
    places = by_time(small["/world/robots/trails"]["translation"])
    assert len(places) == 250  # 25 Hz
    assert places[4.0] == [pytest.approx([2.0, 0.0, 0.0])]
    attitude = by_time(small["/world/robots/q3/body"]["quaternion"])
    assert attitude[4.0] == [pytest.approx([0, 0, 0, 1])]  # x y z w
    assert "translation" not in small.get("/world/trails", {})  # whatever a robot is called


def test_the_rotors_turn_as_one_row_of_four(small):
    rotors = small["/world/robots/q3/body/rotors"]
    first, second = (by_time(rotors["quaternions"])[t] for t in (0.0, 0.2))
    half_turns = np.arcsin([q[2] for q in second])
    assert len(first) == len(second) == 4
    assert np.sign(half_turns).tolist() == [-1, 1, -1, 1]
    assert by_time(rotors["translations"])[0.2][0] == pytest.approx([0.125, 0, 0.055])
    assert "/world/robots/trails/body/wheels" in small  # shown, though nothing tells their speed
    assert "quaternions" not in small["/world/robots/trails/body/wheels"]


def test_circles_change_colour_as_clearance_shrinks_and_a_contact_leaves_a_mark(small):
    circle = small["/world/circles/r2"]["colors"]
    packed = [int.from_bytes(bytes(colour), "big") for colour in CLEARANCE]
    # the gap is 4 m - 0.5 m/s t - 0.79 m: calm, near (0.5 m) at 5.42 s, contact at 6.42 s
    begun = [(time, value[0]) for time, value in circle if time is not None]
    assert begun[:3] == [(0.0, packed[0]), (5.45, packed[1]), (6.45, packed[2])]
    assert len({value for _, value in begun}) == 3
    thick = [value[0] for _, value in small["/world/circles/r2"]["radii"]]
    assert thick[0] > thick[1] > thick[2]  # points of the screen are negative
    ((time, labels),) = small["/world/collisions"]["labels"]
    assert (time, labels[0]) == (6.45, "trails and r2 at 6.5 s")
    ((_, marks),) = [x for x in small["/world/collisions"]["strips"] if x[0] is not None]
    assert np.mean([end for mark in marks for end in mark], axis=0) == pytest.approx(
        [(0.5 * 6.45 + 4) / 2, 0, 0], abs=1e-5
    )


def test_the_trail_is_made_of_pieces_that_hang_together(small):
    pieces = [value[0] for _, value in sorted(
        x for x in small["/world/trails/trails"]["strips"] if x[0] is not None
    )]  # fmt: skip
    assert len(pieces) == 39  # 4 Hz
    assert all(one[1] == other[0] for one, other in pairwise(pieces))
    assert "/world/trails/r2" not in small  # it stood still


def test_arrows_follow_their_robot_and_end_where_it_would_be(small):
    velocity = small["/world/arrows/velocity/trails"]
    assert by_time(velocity["vectors"])[2.0] == [pytest.approx([0.25, 0, 0])]
    assert velocity["frame"] == [(None, ["tf#/world/robots/trails"])]
    pushes = by_time(small["/world/arrows/feed_forward/trails"]["vectors"])
    assert min(pushes) == 3.0
    assert pushes[3.5] == [pytest.approx([0, 0.2, 0])]
    assert pushes[max(pushes)] == [[0, 0, 0]]
    assert max(pushes) == 4.0


def test_the_target_goes_when_there_is_none(small):
    aims = small["/world/targets/trails"]["positions"]
    assert [(t, v) for t, v in aims if v] == [(0.0, [[9.0, 0.0, 0.0]])]
    assert by_time(aims)[6.0] == []


def test_what_the_coordinator_believes_is_a_ghost_that_says_how_old_it_is(small):
    ghost = by_time(small["/world/believed/trails"]["translation"])
    assert ghost[2.0] == [pytest.approx([1.0, 0.1, 0])]
    notes = by_time(small["/world/believed/r2/ghost"]["labels"])
    assert notes[0.0] == [""]
    assert notes[max(notes)] == ["r2: 4.9 s old"]
    assert min(t for t, label in notes.items() if label != [""]) == pytest.approx(6.1)
    colours = by_time(small["/world/believed/r2/ghost"]["colors"])
    assert colours[max(colours)] == [int.from_bytes(bytes(STALE), "big")]
    assert len(small["/world/believed/trails/ghost"]["labels"]) == 1


def test_the_map_has_true_degrees_across_the_antimeridian(small):
    spots = by_time(small["/map/robots/trails"]["positions"])
    for time, east in ((2.0, 1.0), (9.5, 4.75)):
        assert spots[time] == [pytest.approx(ORIGIN.to_geodetic(0.0, east), abs=1e-9)]
    plane = by_time(small["/map/robots/p4"]["positions"])
    lat_deg, lon_deg = ORIGIN.to_geodetic(9.0, 9.5)
    assert plane[9.5] == [pytest.approx((lat_deg, lon_deg), abs=1e-9)]
    assert lon_deg == pytest.approx(-179.99999, abs=1e-5) or lon_deg > 179.99


def test_what_stands_still_is_there_and_what_is_not_known_is_not(small):
    assert len(small["/world/fence"]["strips"][0][1]) == 6
    assert "/world/paths/trails" in small
    assert "/world/goals/trails" in small
    assert "/world/paths/r2" not in small
    assert "/world/goals/r2" not in small
    assert "/world/robots/p4/body" in small


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """So many robots that they are a crowd; two of them touch; one turns up late."""
    path = tmp_path_factory.mktemp("large") / "run.rrd"
    kinds = ("rover", "quadcopter")
    robots = [
        StagedRobot(f"x{i}", kinds[i % 2], i + 1, (3.0 * i, 0, 0), (3.0 * i, 5, 0))
        for i in range(MANY + 1)
    ]
    stage = Stage("large", "safe", tuple(robots), ORIGIN)
    assert stage.crowded
    stream = Stream("large", file=path)
    world = World(stream, stage, colours_of(robots))
    robots.append(StagedRobot("late", "quadcopter", 99, (1.0, 9.0, 0.0)))
    world.add_robot(robots[-1], "#444444")

    def way(i):
        if i == 2:  # meets x0 at 6 s
            return lambda t: (6 - t, 0, 0)
        return lambda t: (robots[i].start[0], robots[i].start[1] + 0.1 * t, 0)

    for i, robot in enumerate(robots):
        seconds = 8.0 if robot.name != "late" else 4.0  # then it is gone
        world.add_truth(fly(robot.name, robot.kind, robot.system_id, way(i), seconds))
    still = VehicleState("x1", 2, 0, 1.0, (3.0, 0.1, 0), STILL, LEVEL, 4, True, Phase.ACTIVE)
    world.add_states([still], 1.0)
    push = (0.0, 0.4, 0.0)
    world.add_targets([Target("x1", 1.0, (3.0, 5.0, 0.0), STILL, STILL, push)])
    world.flush(everything=True)
    stream.close()
    return read(path)


def test_a_crowd_is_one_row_a_time_for_all_of_a_kind(large):
    assert not any(entity.startswith("/world/robots/x") for entity in large)
    rovers = by_time(large["/world/robots/rover"]["translations"])
    quads = by_time(large["/world/robots/quadcopter"]["translations"])
    assert len(rovers) == len(quads) == 160  # 20 Hz
    assert len(rovers[3.0]) == 16
    assert rovers[3.0][0] == pytest.approx([0, 0.3, 0])
    assert (len(quads[3.0]), len(quads[5.0])) == (16, 15)  # the late one is gone again
    assert len(by_time(large["/world/arrows/velocity/rover"]["vectors"])[3.0]) == 16
    assert len(by_time(large["/world/trails/rover"]["strips"])[3.0]) == 16
    assert len(by_time(large["/map/robots/rover"]["positions"])[3.0]) == 16


def test_in_a_crowd_only_those_who_are_near_have_a_circle(large):
    discs = by_time(large["/world/circles/rover"]["centers"])
    assert discs[1.0] == []
    assert [place[0] for place in discs[5.0]] == pytest.approx([0.0, 1.0])
    near, contact = (int.from_bytes(bytes(colour), "big") for colour in CLEARANCE[1:])
    colours = by_time(large["/world/circles/rover"]["colors"])
    assert set(colours[5.0]) == {near}
    assert set(colours[6.0]) == {contact}
    told = [labels[0] for _, labels in large["/world/collisions"]["labels"]]
    assert told == ["x1 and x2 at 2.5 s", "x0 and x2 at 5.5 s"]


def test_a_crowd_has_beliefs_targets_and_pushes_of_those_who_told(large):
    assert by_time(large["/world/believed/quadcopter"]["positions"])[1.0] == [
        pytest.approx([3.0, 0.1, 0.0])
    ]
    assert by_time(large["/world/targets/quadcopter"]["positions"])[1.0] == [[3.0, 5.0, 0.0]]
    pushes = by_time(large["/world/arrows/feed_forward/quadcopter"]["vectors"])
    assert pushes[0.75] == []
    assert pushes[1.0] == [pytest.approx([0.0, 0.2, 0.0])]


def test_names_of_neighbours_are_not_at_one_height(tmp_path, strict):
    robots = [StagedRobot(f"x{i}", "rover", 7, (i, 0, 0), (i, 20, 0)) for i in range(6)]
    stream = Stream("names", file=tmp_path / "run.rrd")
    World(stream, Stage("x", "safe", tuple(robots), ORIGIN), colours_of(robots))
    stream.close()
    seen = read(tmp_path / "run.rrd")
    flags, labels = (
        [seen[f"/world/{what}/x{i}"]["positions"][0][1][0] for i in range(6)]
        for what in ("flags", "labels")
    )
    assert len({round(north, 3) for _, north, _ in flags}) == 6
    ups = [up for _, _, up in labels]
    assert all(abs(a - b) > 0.6 for a, b in pairwise(ups))


def test_a_crowd_stands_out_from_where_it_came_from_and_goes_to(large):
    ((_, (dot,)),) = large["/world/robots/rover"]["colors"]
    ((_, (size,)),) = large["/world/robots/rover"]["radii"]
    assert size <= -4  # points of the screen are negative
    assert dot & 0xFF == 255
    for what in ("goals", "pads", "trails"):
        ((_, paints),) = large[f"/world/{what}/rover"]["colors"]
        assert max(paint & 0xFF for paint in paints) < 128  # opacity
