"""What an autopilot and a robot's physics say to one another. On board: NED, FRD, SI, radians."""

from typing import NamedTuple, Protocol


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


class Robot(Protocol):
    """One robot's physics and onboard controllers: the seam where real hardware would go.

    The caller owns time: it calls `control` every `control_every` physics steps and `advance`
    once per physics step of `dt` seconds.
    """

    dt: float
    control_every: int
    motors_on: bool  # set by arming; off means zero actuator commands
    on_ground: bool

    def kinematics(self) -> Kinematics:
        """Return the true state."""
        ...

    def control(self, setpoint: Setpoint) -> None:
        """Run the PID stack once (over `control_every * dt`) and set the actuator commands."""
        ...

    def reset_control(self) -> None:
        """Forget integrals and held references; called on every arm and mode change."""
        ...

    def advance(self) -> None:
        """Advance physics and disturbance by one step of `dt`."""
        ...

    def actuators(self) -> tuple[float, ...]:
        """Return actuator speeds (rad/s), then their commands, as `actuator_names` says."""
        ...

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """Column names, with unit, of `actuators` for the truth log."""
        ...
