"""Commands reach each vehicle in a form that it follows, and rovers are not sent astray."""

from math import atan2, cos, dist, hypot, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.gcs.laws import HOLD, Command, Peer
from mavherd.gcs.station import ARDUPILOT, GENERIC, PX4
from mavherd.gcs.team.setpoints import (
    LEAD,
    POSITION_GAIN,
    STANDSTILL,
    STOP,
    Form,
    Setpoint,
    form_of,
    setpoint,
)
from mavherd.scenarios.schema import Point, RobotSpec

V_MAX = 2.0
speeds = st.floats(-5, 5)
headings = st.floats(-pi, pi)


def spec(kind, connect="tcp:127.0.0.1:5760"):
    return RobotSpec(name="r", kind=kind, system_id=1, start=Point(0, 0), connect=connect)


def rover(heading=0.0, position=(0.0, 0.0, 0.0)):
    return Peer(1, "rover", position, (0.0, 0.0, 0.0), heading)


@pytest.mark.parametrize(
    ("kind", "stack", "form"),
    [
        ("quadcopter", ARDUPILOT, Form.FULL),
        ("quadcopter", PX4, Form.LED),
        ("rover", ARDUPILOT, Form.COURSE),
        ("rover", PX4, Form.VELOCITY),
        ("rover", GENERIC, Form.FULL),
    ],
)
def test_external_rovers_of_real_flight_stacks_are_told_no_positions(kind, stack, form):
    assert form_of(spec(kind), stack) is form
    assert form_of(spec(kind, connect=None), stack) is Form.FULL  # our own follow everything


def test_who_follows_everything_is_told_everything():
    command = Command((1, 2, 3), (4, 5, 6), (7, 8, 9), 0.1, 0.2, (9, 9, 9))
    assert setpoint(Form.FULL, command, rover(), V_MAX) == Setpoint(
        (1, 2, 3), (4, 5, 6), (7, 8, 9), 0.1, 0.2
    )
    assert setpoint(Form.FULL, HOLD, rover(), V_MAX) == Setpoint(velocity=(0.0, 0.0, 0.0))


def test_px4_copters_are_asked_for_more_than_they_still_lack():
    me = Peer(1, "quadcopter", (0.0, 0.0, 2.0), (0.5, -0.2, 0.3), 0.0)
    told = setpoint(Form.LED, Command(velocity=(1.0, 0.0, 0.4), yaw=0.3), me, V_MAX)
    assert told.velocity == pytest.approx((1.0 + LEAD * 0.5, LEAD * 0.2, 0.4))
    assert told.yaw == 0.3
    there = me._replace(velocity=(1.0, 0.0, 0.0))
    assert setpoint(Form.LED, Command(velocity=(1.0, 0.0, 0.4)), there, V_MAX).velocity == (
        1,
        0,
        0.4,
    )


def test_px4_copters_that_are_told_a_place_or_to_hold_are_told_just_that():
    me = Peer(1, "quadcopter", (0.0, 0.0, 2.0), (0.5, -0.2, 0.3), 0.0)
    for command in (HOLD, Command((1, 2, 3), (4, 5, 6))):
        assert setpoint(Form.LED, command, me, V_MAX) == setpoint(Form.FULL, command, me, V_MAX)


def test_a_stop_has_no_course_for_an_ardurover_to_turn_to():
    """Of a zero velocity it would take the course, atan2(0, 0): north."""
    for command in (HOLD, Command(velocity=(0, 0, 0)), Command(velocity=(0.5 * STANDSTILL, 0, 0))):
        assert setpoint(Form.COURSE, command, rover(), V_MAX) is STOP
    assert (STOP.velocity, STOP.forward, STOP.yaw, STOP.yaw_rate) == (None, 0.0, None, 0.0)


@given(east=speeds, north=speeds, heading=headings)
def test_a_course_is_driven_at_the_speed_that_its_nose_allows(east, north, heading):
    s = setpoint(Form.COURSE, Command(velocity=(east, north, 0)), rover(heading), V_MAX)
    speed = hypot(east, north)
    if speed < STANDSTILL:
        assert s is STOP
        return
    assert s.yaw == pytest.approx(atan2(north, east))
    assert s.yaw_rate is None
    along = east * cos(heading) + north * sin(heading)  # what of the wish the nose points to
    assert s.forward == pytest.approx(max(0.0, along), abs=1e-9)


@given(east=speeds, north=speeds, heading=headings)
def test_a_velocity_keeps_its_direction_and_is_never_faster(east, north, heading):
    me = rover(heading, (3.0, 4.0, 0.0))
    s = setpoint(Form.VELOCITY, Command(velocity=(east, north, 0)), me, V_MAX)
    speed = hypot(east, north)
    if speed < STANDSTILL:  # of a zero velocity, too, PX4 takes the course: north
        assert s == Setpoint(position=me.position)
        return
    told = hypot(*s.velocity)
    assert STANDSTILL * (1 - 1e-9) <= told <= speed + 1e-9  # or it would not know where to turn
    assert s.velocity[0] * north == pytest.approx(s.velocity[1] * east, abs=1e-9)


def test_a_px4_rover_that_is_to_hold_is_sent_to_where_it_is():
    me = rover(1.0, (3.0, 4.0, 0.0))
    assert setpoint(Form.VELOCITY, HOLD, me, V_MAX) == Setpoint(position=me.position)


def test_a_position_is_closed_in_on_with_its_velocity_fed_forward():
    command = Command(position=(3, 4, 0), velocity=(0.1, 0, 0))
    me = rover(atan2(4, 3), (2.9, 4.2, 0.0))
    s = setpoint(Form.VELOCITY, command, me, V_MAX)
    wanted = (0.1 + POSITION_GAIN * 0.1, -POSITION_GAIN * 0.2)
    assert atan2(s.velocity[1], s.velocity[0]) == pytest.approx(atan2(wanted[1], wanted[0]))
    far = setpoint(Form.COURSE, Command(position=(300, 400, 0)), rover(atan2(4, 3)), V_MAX)
    assert far.forward == pytest.approx(V_MAX)


class ArduRover:
    """ArduRover's manner: heads for the yaw it is told, and drives along its nose meanwhile."""

    def __init__(self, heading):
        self.x = self.y = 0.0
        self.heading, self.speed = heading, 0.0

    def drive(self, s, dt):
        error = 0.0 if s.yaw is None else (s.yaw - self.heading + pi) % (2 * pi) - pi
        self.heading += max(-1.5, min(1.5, 2.0 * error)) * dt
        self.speed += max(-dt, min(dt, (s.forward or 0.0) - self.speed))  # 1 m/s^2
        self.x += self.speed * cos(self.heading) * dt
        self.y += self.speed * sin(self.heading) * dt


@pytest.mark.parametrize("heading", [pi / 2, -pi / 2, 3.0])
def test_such_a_rover_follows_a_circle_from_any_heading(heading):
    vehicle, errors, dt = ArduRover(heading), [], 0.05
    vehicle.x = 5.0
    for tick in range(1200):
        angle = 0.1 * tick * dt  # 0.5 m/s
        place = (5 * cos(angle), 5 * sin(angle), 0.0)
        velocity = (-0.5 * sin(angle), 0.5 * cos(angle), 0.0)
        me = rover(vehicle.heading, (vehicle.x, vehicle.y, 0.0))
        vehicle.drive(setpoint(Form.COURSE, Command(place, velocity), me, V_MAX), dt)
        errors.append(dist(place[:2], (vehicle.x, vehicle.y)))
    assert max(errors[400:]) < 0.1
    assert max(errors) < 1.6  # while it turned about


def test_such_a_rover_that_has_overshot_does_not_run_away():
    vehicle = ArduRover(0.0)
    vehicle.speed = 1.0
    for _ in range(400):
        me = rover(vehicle.heading, (vehicle.x, vehicle.y, 0.0))
        vehicle.drive(setpoint(Form.COURSE, Command(position=(-2, 0, 0)), me, V_MAX), 0.05)
    assert dist((vehicle.x, vehicle.y), (-2, 0)) < 0.2
