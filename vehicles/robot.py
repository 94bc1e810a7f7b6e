"""What an autopilot and a robot's physics say to one another. On board: NED, FRD, SI, radians."""

from abc import ABC, abstractmethod
from math import isfinite
from typing import Final, NamedTuple

from .physics import Force

_SLOWEST: Final = 0.02  # m/s: less is no speed to go anywhere


class Vec3(NamedTuple):
    """A vector in local NED (m, m/s or m/s^2)."""

    north: float = 0.0
    east: float = 0.0
    down: float = 0.0


class Setpoint(NamedTuple):
    """What the robot shall do now; None means "not given". All None: hold where you are.

    Position, velocity and acceleration are local NED relative to the fleet origin. Given
    together, velocity and acceleration are feed-forward to the position loop (eq. 15+22 and
    18+23); velocity alone is tracked as a velocity.
    """

    position: Vec3 | None = None
    velocity: Vec3 | None = None
    acceleration: Vec3 | None = None
    yaw: float | None = None  # rad, clockwise from north
    yaw_rate: float | None = None  # rad/s, positive turns right


class AttitudeSetpoint(NamedTuple):
    """What a pilot or SET_ATTITUDE_TARGET asks for; None means "not given".

    A quadcopter takes roll and pitch with a yaw, a yaw rate or neither, or else all three body
    rates; and one of thrust and climb rate (neither: keep the height). Beside an attitude the
    rates are feed-forward. A rover takes the yaw, the yaw rate and the thrust: a share of its
    full speed along its own heading, negative backwards.
    """

    roll: float | None = None  # rad; None with pitch None: fly the body rates
    pitch: float | None = None  # rad, positive lifts the nose
    yaw: float | None = None  # rad, clockwise from north
    yaw_rate: float | None = None  # rad/s, positive turns right
    thrust: float | None = None  # 0..1 of full thrust; a rover's -1..1
    climb_rate: float | None = None  # m/s, positive up; used when there is no thrust
    roll_rate: float | None = None  # rad/s about body axes
    pitch_rate: float | None = None


class Limits(NamedTuple):
    """What a robot's controllers keep within now; a rover has only the first two."""

    speed: float  # m/s, horizontal
    turn: float  # rad/s about the vertical
    climb: float = 0.0  # m/s
    descent: float = 0.0  # m/s
    tilt: float = 0.0  # rad
    hover_thrust: float = 0.0  # share of full thrust that carries the weight


class Kinematics(NamedTuple):
    """Where a robot truly is and how it moves."""

    north: float
    east: float
    down: float
    v_north: float
    v_east: float
    v_down: float
    qw: float  # attitude, body FRD to local NED
    qx: float
    qy: float
    qz: float
    roll_rate: float  # rad/s about body axes
    pitch_rate: float
    yaw_rate: float


class Robot(ABC):
    """One robot's physics and onboard controllers: the seam where real hardware would go.

    The caller owns time: it calls `control` every `control_every` physics steps and `advance`
    once per physics step of `dt` seconds. A speed limit must be positive and finite, else
    ValueError; one beyond reason (`fastest`, `fastest_climb` in m/s) is brought within it.
    """

    def __init__(self, dt: float, control_every: int, fastest: float, fastest_climb: float) -> None:
        self.dt = dt
        self.control_every = control_every
        self.motors_on = False  # set by arming; off means zero actuator commands
        self.on_ground = True
        self._fastest = fastest
        self._fastest_climb = fastest_climb
        self._speed_limit: float | None = None
        self._climb_limit: float | None = None
        self._descent_limit: float | None = None

    @property
    def speed_limit(self) -> float | None:
        """The limit in m/s, horizontal, in place of `v_max`; None: that again."""
        return self._speed_limit

    @speed_limit.setter
    def speed_limit(self, limit: float | None) -> None:
        self._speed_limit = _checked("speed_limit", limit, self._fastest)
        self._limits_changed()

    @property
    def climb_limit(self) -> float | None:
        """The limit in m/s, in place of `v_up_max`; a rover only keeps it."""
        return self._climb_limit

    @climb_limit.setter
    def climb_limit(self, limit: float | None) -> None:
        self._climb_limit = _checked("climb_limit", limit, self._fastest_climb)
        self._limits_changed()

    @property
    def descent_limit(self) -> float | None:
        """The limit in m/s, in place of `v_down_max`; likewise."""
        return self._descent_limit

    @descent_limit.setter
    def descent_limit(self, limit: float | None) -> None:
        self._descent_limit = _checked("descent_limit", limit, self._fastest_climb)
        self._limits_changed()

    @abstractmethod
    def place(self) -> tuple[float, float, float]:
        """Return where it truly is: north, east, down."""

    @abstractmethod
    def kinematics(self) -> Kinematics:
        """Return the true state."""

    @abstractmethod
    def control(self, setpoint: Setpoint | AttitudeSetpoint) -> None:
        """Run the PID stack once (over `control_every * dt`) and set the actuator commands."""

    @property
    @abstractmethod
    def limits(self) -> Limits:
        """Return the limits that hold now."""

    @abstractmethod
    def retune(self, **changes: float) -> None:
        """Replace gains and limits by their names, also in flight.

        Raises ValueError, and changes nothing, for a name or value that cannot be.
        """

    @abstractmethod
    def reset_control(self) -> None:
        """Forget integrals and held references; called on every arm and mode change."""

    @abstractmethod
    def advance(self) -> None:
        """Advance physics and disturbance by one step of `dt`."""

    @abstractmethod
    def actuators(self) -> tuple[float, ...]:
        """Return actuator speeds (rad/s), then their commands, as `actuator_names` says."""

    @abstractmethod
    def commands(self) -> tuple[float, ...]:
        """Return the motion that the controllers ask for, as `command_names` says; NaN: none."""

    @abstractmethod
    def outputs(self) -> tuple[float, ...]:
        """Return each actuator's command as a share of its most: rotors 0..1, wheels -1..1."""

    @abstractmethod
    def specific_force(self) -> Force:
        """Return the acceleration less gravity in m/s^2, along body axes: what an IMU feels."""

    @abstractmethod
    def shaft_power(self) -> float:
        """Return the mechanical power in W that the motors put into their shafts now."""

    @property
    @abstractmethod
    def actuator_names(self) -> tuple[str, ...]:
        """Column names, with unit, of `actuators` for the truth log."""

    @property
    @abstractmethod
    def command_names(self) -> tuple[str, ...]:
        """Column names, with unit, of `commands`."""

    @abstractmethod
    def _limits_changed(self) -> None:
        """Take up the speed limits."""


def _checked(name: str, limit: float | None, fastest: float) -> float | None:
    """Return `limit` within reason; raise ValueError where it is no speed."""
    if limit is None:
        return None
    if not (isfinite(limit) and limit > 0):
        raise ValueError(f"{name} must be positive and finite, got {limit}")
    return max(_SLOWEST, min(limit, fastest))
