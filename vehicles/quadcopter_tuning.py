"""Gains and limits of the quadcopter's controllers, and the profiles that one can choose from."""

from dataclasses import dataclass

from .physics import require_positive

_LOW, _HIGH = 0.1, 50.0  # m/s^2 and s, of what may also be 0


@dataclass(frozen=True, slots=True, kw_only=True)
class QuadcopterTuning:
    """Gains and limits of the onboard controllers."""

    roll_p: float = 120.0  # 1/s^2; N m/rad in `printed_form`; pitch uses the same
    roll_d: float = 20.0  # 1/s; N m s/rad
    yaw_p: float = 6.0
    yaw_i: float = 0.5
    yaw_d: float = 4.0
    altitude_p: float = 12.0  # 1/s^2
    altitude_i: float = 4.0  # 1/s^3
    altitude_d: float = 6.0  # 1/s
    altitude_i_limit: float = 2.0  # m/s^2, the integral's share
    position_p: float = 4.0  # 1/s^2
    position_d: float = 3.1  # 1/s
    v_max: float = 1.5  # m/s, horizontal
    v_up_max: float = 2.5  # m/s
    v_down_max: float = 1.5  # m/s
    accel_max: float = 0.0  # m/s^2, horizontal; 0: what `tilt_limit` gives
    climb_accel_max: float = 0.0  # m/s^2, up and down; 0: what the rotors give
    spool_time: float = 0.0  # s from idle to lift-off
    tilt_limit: float = 0.5235987755982988  # rad, 30 degrees
    yaw_rate_max: float = 2.0  # rad/s
    printed_form: bool = False
    """Attitude gains give torques, not accelerations, and the derivative is that of the angle
    error, a moving command included: Table 2 flies only so. Eq. 19 and 20 as in the text."""

    def __post_init__(self) -> None:
        optional = ("accel_max", "climb_accel_max", "spool_time")
        integrals = ("yaw_i", "altitude_i", "altitude_i_limit")
        require_positive(self, may_be_zero=(*integrals, "roll_d", *optional))
        if self.tilt_limit > 1.2:
            raise ValueError(f"tilt_limit must be at most 1.2 rad (69 deg), got {self.tilt_limit}")
        for name in optional:
            value = getattr(self, name)
            if value and not _LOW <= value <= _HIGH:
                raise ValueError(f"{name} must be 0 or {_LOW} to {_HIGH}, got {value}")


PROFILES = {
    "default": QuadcopterTuning(),
    "paper": QuadcopterTuning(  # Table 2
        roll_p=3.0,
        roll_d=2.0,
        yaw_p=0.5,
        yaw_i=0.1,
        yaw_d=0.1,
        altitude_p=30.0,
        altitude_i=20.0,
        altitude_d=15.0,
        altitude_i_limit=100.0,
        position_p=5.0,
        position_d=3.0,
        v_up_max=100.0,
        v_down_max=100.0,
        printed_form=True,
    ),
    "ardupilot": QuadcopterTuning(  # ArduCopter 4.6's WPNAV_*, ANGLE_MAX, TKOFF_SLEW_TIME
        v_max=10.0,
        v_up_max=2.5,
        v_down_max=1.5,
        accel_max=2.5,
        climb_accel_max=1.0,
        spool_time=2.0,
    ),
}
