"""No command leads out of the fence, and one from outside leads back."""

from math import cos, dist, pi, sin

from hypothesis import given
from hypothesis import strategies as st

from mavherd.gcs.laws import HOLD, Command
from mavherd.gcs.team.fence import RETURN, confine, confine_along
from mavherd.scenarios.schema import Fence

FENCE = Fence(east=(-20.0, 20.0), north=(-5.0, 30.0), up=10.0)
DT = 0.05
speeds = st.tuples(*[st.floats(-30, 30)] * 3)
inside = st.tuples(st.floats(-20, 20), st.floats(-5, 30), st.floats(0, 10))
anywhere = st.tuples(*[st.floats(-200, 200)] * 3)


def beyond(position) -> float:
    """Return how far outside the box a place is; below the ground counts as inside."""
    east, north, up = position
    nearest = (min(20, max(-20, east)), min(30, max(-5, north)), min(10, up))
    return dist(position, nearest)


def moved(position, velocity, dt=DT):
    return tuple(x + v * dt for x, v in zip(position, velocity, strict=True))


@given(inside, st.lists(speeds, min_size=1, max_size=40), st.sampled_from([0.01, DT, 0.1, 1.0]))
def test_from_inside_no_sequence_of_velocities_leads_out(position, asked, dt):
    for velocity in asked:
        sent = confine(FENCE, position, Command(velocity=velocity))
        position = moved(position, sent.velocity, dt)
        assert beyond(position) < 1e-9


@given(anywhere, speeds)
def test_from_outside_whatever_is_asked_leads_back_at_walking_pace(position, velocity):
    start, outside = position, beyond(position)
    for _ in range(20):
        sent = confine(FENCE, position, Command(velocity=velocity))
        position = moved(position, sent.velocity)
        assert beyond(position) <= outside
        outside = beyond(position)
    if beyond(start) > 5:
        assert beyond(start) - outside >= 0.9 * RETURN * 20 * DT / 3**0.5


@given(inside, speeds)
def test_what_leads_inwards_or_stays_far_from_the_sides_is_left_alone(position, velocity):
    sent = confine(FENCE, position, Command(velocity=velocity, yaw_rate=0.3))
    assert sent.yaw_rate == 0.3
    sides = ((-20, 20), (-5, 30), (-1e9, 10))
    for x, v, got, (low, high) in zip(position, velocity, sent.velocity, sides, strict=True):
        room = high - x if v > 0 else x - low
        if abs(v) <= room / 2:
            assert got == v
        assert abs(got) <= abs(v)


@given(anywhere, anywhere, speeds, speeds)
def test_a_target_is_clamped_and_no_acceleration_undoes_a_cut(position, target, velocity, push):
    command = Command(target, velocity, push)
    sent = confine(FENCE, position, command)
    assert beyond(sent.position) == 0
    assert (sent.position == target) == (beyond(target) == 0)
    for was, is_, v, got in zip(push, sent.acceleration, velocity, sent.velocity, strict=True):
        assert is_ == (0.0 if was * (v - got) > 0 else was)


@given(anywhere)
def test_hold_stays_hold(position):
    assert confine(FENCE, position, HOLD) == HOLD


def test_standing_still_outside_leads_back_and_a_yaw_alone_is_none_of_its_business():
    sent = confine(FENCE, (30.0, 0.0, 12.0), Command(velocity=(0.0, 0.0, 0.0)))
    assert sent.velocity == (-RETURN, 0.0, -RETURN)
    assert confine(FENCE, (30.0, 0.0, 1.0), Command(yaw=1.0)) == Command(yaw=1.0)


@given(inside, st.floats(-pi, pi), st.lists(st.floats(0, 3), min_size=1, max_size=40))
def test_a_rover_that_is_still_turning_does_not_drive_out_along_its_nose(start, heading, asked):
    position = start
    for speed in asked:
        forward = confine_along(FENCE, position, heading, speed)
        assert 0 <= forward <= speed
        step = (forward * cos(heading), forward * sin(heading), 0.0)
        position = moved(position, step)
        assert beyond(position) < 1e-9


def test_a_rover_that_stands_outside_may_drive_back_but_no_farther():
    assert confine_along(FENCE, (21.0, 0.0, 0.0), pi, 0.4) == 0.4
    assert confine_along(FENCE, (21.0, 0.0, 0.0), 0.0, 0.4) == 0.0
