"""In what form a command reaches a vehicle: real autopilots do not all follow all of it. ENU.

Our own vehicles and copters close the position loop themselves and take feed-forwards in the same
message. Rovers of real flight stacks ignore the velocity in a position target and then follow two
metres behind a moving one; so their loop is closed here, and they are told velocities only (of the
paper's law, not the turn rate).
"""

from enum import Enum
from math import atan2, cos, hypot
from typing import NamedTuple

from ...scenarios.schema import RobotSpec
from ...transport.frames import Triple, wrap_angle
from ..laws import HOLD, Command, Peer
from ..station import ARDUPILOT, PX4, FlightStack

POSITION_GAIN = 0.8  # 1/s, position error to velocity; tracks to 0.14 m, with ArduRover measured
LEAD = 1.2  # of a velocity error on top of the velocity, for those that are slow to take it up
STANDSTILL = 0.05  # m/s: a slower rover stands, and does not turn about for every centimetre
_STILL: Triple = (0.0, 0.0, 0.0)


class Form(Enum):
    """What a vehicle follows."""

    FULL = "position with feed-forwards, or velocity"
    VELOCITY = "velocity"
    LED = "velocity, asked for with a lead"
    COURSE = "speed along the nose, and where the nose shall point"


class Setpoint(NamedTuple):
    """What one SET_POSITION_TARGET says. None: not given."""

    position: Triple | None = None
    velocity: Triple | None = None
    acceleration: Triple | None = None
    yaw: float | None = None  # rad, counter-clockwise from east
    yaw_rate: float | None = None  # rad/s, positive turns left
    forward: float | None = None  # m/s along the nose, in place of a velocity


STOP = Setpoint(forward=0.0, yaw_rate=0.0)
"""What stops an ArduRover. A velocity of zero has a course too: it would turn to north."""


def form_of(spec: RobotSpec, stack: FlightStack | None) -> Form:
    """Return what a vehicle of this flight stack follows; our own follow everything."""
    if not spec.external or stack is None or spec.kind in stack.follows_velocity:
        is_slow = spec.external and spec.kind == "quadcopter" and stack is PX4
        return Form.LED if is_slow else Form.FULL
    return Form.COURSE if stack is ARDUPILOT else Form.VELOCITY


def full(command: Command) -> Setpoint:
    """Return `command` for a vehicle that follows all of it."""
    position, velocity, acceleration, yaw, yaw_rate, _ = command
    if velocity is None and command == HOLD:
        velocity = _STILL
    return Setpoint(position, velocity, acceleration, yaw, yaw_rate)


def setpoint(form: Form, command: Command, me: Peer, v_max: float) -> Setpoint:
    """Return `command` in the form that the vehicle follows, which is `me` and does `v_max`."""
    if form in (Form.FULL, Form.LED):
        if form is Form.LED and command.position is None and command.velocity:
            command = command._replace(velocity=_led(command.velocity, me.velocity))
        return full(command)
    east, north = _velocity(command, me, v_max)
    speed, course = hypot(east, north), atan2(north, east)
    # None of them drives more slowly because its nose points elsewhere: it would run off sideways.
    onward = cos(wrap_angle(course - me.heading))
    forward = max(0.0, onward) * speed
    if form is Form.COURSE:
        return STOP if speed < STANDSTILL else Setpoint(forward=forward, yaw=course)
    if speed < STANDSTILL:
        return Setpoint(position=me.position)  # a PX4 rover, too, would turn a zero to north
    # Without a speed there is no course to turn to.
    share = max(forward / speed, STANDSTILL / speed)
    return Setpoint(velocity=(share * east, share * north, 0.0))


def _led(wish: Triple, velocity: Triple) -> Triple:
    """Return a velocity with its error in the plane added: PX4 is seconds late for a part of it."""
    (east, north, up), (is_east, is_north, _) = wish, velocity
    return (east + LEAD * (east - is_east), north + LEAD * (north - is_north), up)


def _velocity(command: Command, me: Peer, v_max: float) -> tuple[float, float]:
    """Return the velocity in the plane that follows `command`, with the position loop closed."""
    east, north, _ = command.velocity or _STILL
    if command.position is None:
        return east, north
    east += POSITION_GAIN * (command.position[0] - me.position[0])
    north += POSITION_GAIN * (command.position[1] - me.position[1])
    speed = hypot(east, north)
    if speed > v_max:
        east, north = east * v_max / speed, north * v_max / speed
    return east, north
