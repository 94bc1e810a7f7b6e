"""What a pilot's sticks do: STABILIZE, ALT_HOLD, LOITER and a rover's MANUAL."""

from math import cos, sin
from typing import TYPE_CHECKING

from ...transport.frames import yaw_of
from ..config import SLICE_US
from ..robot import AttitudeSetpoint, Setpoint, Vec3
from .sticks import PilotInput as PilotInput

if TYPE_CHECKING:
    from .autopilot import Autopilot

_IDLE = 0.05  # of the throttle's travel: less is "off"
_MIDDLE = 0.5  # of the throttle's travel: hover
_LEANING = 0.5  # floor of cos(roll) cos(pitch) by which thrust grows to keep the height
_UPDATE = SLICE_US * 1e-6  # s


class Stabilize:
    """Sticks are roll and pitch, a yaw rate and the thrust; half throttle hovers.

    Without a throttle stick (no pilot was ever heard, or he has gone) it keeps level and its
    height: the vehicle stays up, as with ALT_HOLD's centred sticks. ArduPilot's simulator
    would see a radio with its throttle low, and sink.
    """

    lands = False

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot

    @property
    def lifts(self) -> bool:
        """Whether the throttle is above idle."""
        throttle = self._autopilot.pilot.sticks.throttle
        return throttle is not None and throttle > _IDLE

    def update(self) -> AttitudeSetpoint:
        """Return what the sticks ask for."""
        autopilot = self._autopilot
        leaning = _leaning(autopilot)
        throttle = autopilot.pilot.sticks.throttle
        if throttle is None:
            return leaning._replace(climb_rate=0.0)
        hover = autopilot.robot.limits.hover_thrust
        if throttle < _MIDDLE:
            thrust = throttle / _MIDDLE * hover
        else:
            thrust = hover + (throttle - _MIDDLE) / (1 - _MIDDLE) * (1 - hover)
        k = autopilot.robot.kinematics()
        upright = 1 - 2 * (k.qx * k.qx + k.qy * k.qy)
        return leaning._replace(thrust=min(1.0, thrust / max(upright, _LEANING)))


class AltHold:
    """Sticks are roll and pitch, a yaw rate and a climb rate; a centred throttle keeps height.

    Nothing slows the vehicle but leaning against its motion: level, it goes on as it went.
    """

    lands = False

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._climb = Climb(autopilot)

    @property
    def lifts(self) -> bool:
        """Whether the throttle asks for a climb."""
        return self._climb.wanted > 0

    def update(self) -> AttitudeSetpoint:
        """Return what the sticks ask for."""
        return _leaning(self._autopilot)._replace(climb_rate=self._climb.update())


class Loiter:
    """Sticks are a velocity along the heading and across it; let go, the vehicle stays put."""

    lands = False

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._climb = Climb(autopilot)

    @property
    def lifts(self) -> bool:
        """Whether the throttle asks for a climb."""
        return self._climb.wanted > 0

    def update(self) -> Setpoint:
        """Return what the sticks ask for."""
        autopilot = self._autopilot
        sticks = autopilot.pilot.sticks
        climb = self._climb.update()
        yaw_rate = _yaw_rate(autopilot)
        if not (climb or sticks.roll or sticks.pitch):
            return Setpoint(yaw_rate=yaw_rate)
        speed = autopilot.robot.limits.speed
        forward, right = -sticks.pitch * speed, sticks.roll * speed
        yaw = yaw_of(autopilot.robot.kinematics()[6:10])
        c, s = cos(yaw), sin(yaw)
        velocity = Vec3(c * forward - s * right, s * forward + c * right, -climb)
        return Setpoint(velocity=velocity, yaw_rate=yaw_rate)


class Manual:
    """A rover's sticks are speed and turn rate; without a pilot it stands."""

    lifts = False
    lands = False

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot

    def update(self) -> AttitudeSetpoint:
        """Return what the sticks ask for; full throttle is CRUISE_SPEED.

        Backwards the stick steers as a car's wheel does (PILOT_STEER_TYPE 0).
        """
        autopilot = self._autopilot
        sticks, limits = autopilot.pilot.sticks, autopilot.robot.limits
        full = autopilot.settings.cruise_speed / limits.speed or 1.0
        throttle = sticks.throttle or 0.0
        side = -1.0 if throttle < 0 else 1.0
        return AttitudeSetpoint(yaw_rate=side * sticks.roll * limits.turn, thrust=throttle * full)


class Climb:
    """The climb rate that a throttle stick asks for, within PILOT_ACCEL_Z."""

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._rate = 0.0

    @property
    def wanted(self) -> float:
        """Return the climb rate in m/s; 0 inside the dead zone and without a pilot."""
        autopilot = self._autopilot
        settings, throttle = autopilot.settings, autopilot.pilot.sticks.throttle
        if throttle is None:
            return 0.0
        off = throttle - _MIDDLE
        share = (abs(off) - settings.throttle_deadzone) / (_MIDDLE - settings.throttle_deadzone)
        if share <= 0:
            return 0.0
        up, down = settings.pilot_speed_up, settings.pilot_speed_down
        return share * up if off > 0 else -share * (down or up)

    def update(self) -> float:
        """Return the climb rate to fly now, and open the robot's limits for it."""
        autopilot, settings = self._autopilot, self._autopilot.settings
        up = settings.pilot_speed_up
        autopilot.robot.climb_limit = up
        autopilot.robot.descent_limit = settings.pilot_speed_down or up
        step = settings.pilot_accel_z * _UPDATE if autopilot.in_air else up
        self._rate = min(max(self.wanted, self._rate - step), self._rate + step)
        return self._rate


def _leaning(autopilot: "Autopilot") -> AttitudeSetpoint:
    """Return the angles and the yaw rate of the sticks."""
    sticks = autopilot.pilot.sticks
    tilt = autopilot.robot.limits.tilt
    return AttitudeSetpoint(sticks.roll * tilt, sticks.pitch * tilt, yaw_rate=_yaw_rate(autopilot))


def _yaw_rate(autopilot: "Autopilot") -> float:
    return autopilot.pilot.sticks.yaw * autopilot.settings.pilot_yaw_rate
