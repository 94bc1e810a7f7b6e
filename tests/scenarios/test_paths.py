"""A reference point stays on its path, at its speed, and stands still before and after."""

from math import dist, hypot, isclose, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.scenarios.paths import Reference, path_duration, reference, takeoff_up
from mavherd.scenarios.schema import (
    Circle,
    Goto,
    Hold,
    Path,
    Point,
    Rectangle,
    RobotSpec,
    Team,
    Waypoints,
)

TEAM = Team(takeoff_up=2.5)
CORNERS = (Point(0, 0, 1), Point(3, 0, 1), Point(3, 0, 1), Point(3, 4, 4))

MOVING = [
    Circle(centre=Point(1, 2), radius=2, speed=0.4, laps=1.3),
    Circle(centre=Point(1, 2), radius=2, speed=0.4, start_angle=2.0, clockwise=True),
    Rectangle(corner=Point(-1, -1, 3), width=4, height=3, speed=0.7, laps=2.25),
    Rectangle(corner=Point(-1, -1), width=4, height=3, clockwise=True),
    Waypoints(points=CORNERS, speed=0.3),
    Waypoints(points=(Point(0, 0), Point(1, 0), Point(0, 0), Point(0, 1)), speed=0.3),
]


def at(path: Path, t: float, kind: str = "quadcopter") -> Reference:
    spec = RobotSpec(name="r", kind=kind, system_id=1, start=Point(7, 8), path=path)
    return reference(path, spec, TEAM, t)


@pytest.mark.parametrize("path", MOVING)
def test_it_moves_at_constant_speed_and_position_integrates_velocity(path):
    end, dt = path_duration(path), 1e-3
    assert end
    corners = 0
    for i in range(200):
        t = i / 200 * (end - dt)
        here, there = at(path, t), at(path, t + dt)
        assert isclose(hypot(*here.velocity), path.speed)
        if hypot(*[a - b for a, b in zip(here.velocity, there.velocity, strict=True)]) > 0.01:
            corners += 1  # the velocity jumps
            continue
        mean = [(b - a) / dt for a, b in zip(here.position, there.position, strict=True)]
        assert dist(mean, here.velocity) < 1e-3
    assert corners < 12


@pytest.mark.parametrize("path", MOVING)
def test_it_stands_at_the_ends_before_and_after(path):
    end = path_duration(path)
    assert end
    for outside, inside in ((-3.0, 0.0), (end + 3, end - 1e-9)):
        assert at(path, outside).velocity == (0, 0, 0)
        assert dist(at(path, outside).position, at(path, inside).position) < 1e-6
    assert hypot(*at(path, 0.0).velocity) > 0
    assert at(path, end).velocity == (0, 0, 0)


def test_a_circle_keeps_its_radius_and_turns_left_unless_clockwise():
    circle = Circle(centre=Point(0, 0), radius=3, start_angle=-pi / 2)
    start = at(circle, 0)
    assert dist(start.position[:2], (0, -3)) < 1e-12
    assert start.velocity[0] == 0.5  # east
    for t in range(40):
        assert isclose(hypot(*at(circle, t).position[:2]), 3)
    mirrored = Circle(centre=Point(0, 0), radius=3, start_angle=pi / 2, clockwise=True)
    for t in range(40):
        (east, north, _), (e, n, _) = at(circle, t).position, at(mirrored, t).position
        assert dist((east, -north), (e, n)) < 1e-9


def test_a_rectangle_starts_south_west_and_goes_east_or_clockwise_north():
    def places(clockwise: bool, *times: float) -> list[tuple[float, ...]]:
        path = Rectangle(corner=Point(0, 0), width=4, height=3, speed=1, clockwise=clockwise)
        return [at(path, t).position[:2] for t in times]

    assert places(False, 0, 4, 7, 11, 14) == [(0, 0), (4, 0), (4, 3), (0, 3), (0, 0)]
    assert places(True, 0, 3, 7, 10, 14) == [(0, 0), (0, 3), (4, 3), (4, 0), (0, 0)]


def test_waypoints_pass_every_point_and_climb_along_the_legs():
    path = Waypoints(points=CORNERS, speed=0.5)
    assert path_duration(path) == (3 + 5) / 0.5
    assert at(path, 6.0).position == (3, 0, 1)
    assert dist(at(path, 11.0).position, (3, 2, 2.5)) < 1e-12
    assert at(path, 100).position == (3, 4, 4)


def test_hold_and_goto_have_no_duration_and_stand():
    assert path_duration(Hold()) is None
    assert path_duration(Goto(target=Point(1, 1))) is None
    assert at(Hold(), 5) == Reference((7, 8, 2.5), (0, 0, 0))
    assert at(Hold(at=Point(1, 2, 3)), 5).position == (1, 2, 3)
    assert at(Goto(target=Point(1, 2)), -5).position == (1, 2, 2.5)


def test_rovers_stay_on_the_ground_and_quadcopters_take_off_to_their_first_point():
    for path in (*MOVING[:2], Hold(), Goto(target=Point(1, 1))):
        assert at(path, 3.0, "rover").position[2] == 0
        rover = RobotSpec(name="r", kind="rover", system_id=1, start=Point(0, 0), path=path)
        quad = RobotSpec(name="q", kind="quadcopter", system_id=1, start=Point(0, 0), path=path)
        assert takeoff_up(rover, TEAM) == 0
        assert takeoff_up(quad, TEAM) == 2.5
    quad = RobotSpec(name="q", kind="quadcopter", system_id=1, start=Point(0, 0), path=MOVING[4])
    assert takeoff_up(quad, TEAM) == 1


def test_waypoints_of_mixed_heights_are_a_mistake():
    with pytest.raises(ValueError, match="all name a height"):
        Waypoints(points=(Point(0, 0), Point(1, 1, 1)))


@given(st.sampled_from(MOVING), st.floats(-1e3, 1e3), st.floats(0, 1))
def test_it_never_outruns_its_speed(path, t, dt):
    moved = dist(at(path, t).position, at(path, t + dt).position)
    assert moved <= path.speed * dt + 1e-9
