"""Parameters of ours that no flight stack has a name for: bodies and the paper's controllers."""

from .parameter import INT8
from .rows import constant, fact, gain, grouped

_PAPER = fact(
    INT8,
    "HERD_PRINTED",
    0,
    "Controllers exactly as the paper prints them (profile paper)",
    follows="tuning.printed_form",
)

QUADCOPTER_BODY = grouped(
    "HERD",
    constant("HERD_MASS", "mass", "Mass", "kg"),
    constant("HERD_INERTIA_X", "inertia_x", "Moment of inertia, roll", "kg m^2"),
    constant("HERD_INERTIA_Y", "inertia_y", "Moment of inertia, pitch", "kg m^2"),
    constant("HERD_INERTIA_Z", "inertia_z", "Moment of inertia, yaw", "kg m^2"),
    constant("HERD_ROTOR_INER", "rotor_inertia", "Moment of inertia of a rotor", "kg m^2"),
    constant("HERD_ARM_LENGTH", "arm_length", "Rotor shaft to centre of gravity", "m"),
    constant("HERD_THRUST_COEF", "thrust_coefficient", "Thrust over rotor speed squared", "N s^2"),
    constant("HERD_TORQUE_COEF", "torque_per_thrust", "Rotor drag torque over thrust", "m"),
    constant("HERD_ROTOR_MAX", "max_rotor_speed", "Full rotor speed", "rad/s"),
    constant("HERD_MOTOR_LAG", "motor_lag", "Time constant of a motor", "s"),
)

QUADCOPTER_GAINS = grouped(
    "HERD",
    gain("HERD_ATT_P", "roll_p", "Roll and pitch: acceleration per angle", "1/s/s"),
    gain("HERD_ATT_D", "roll_d", "Roll and pitch: acceleration per rate", "1/s"),
    gain("HERD_YAW_P", "yaw_p", "Yaw: acceleration per angle", "1/s/s"),
    gain("HERD_YAW_I", "yaw_i", "Yaw: acceleration per integral of angle", "1/s/s/s"),
    gain("HERD_YAW_D", "yaw_d", "Yaw: acceleration per rate", "1/s"),
    gain("HERD_ALT_P", "altitude_p", "Height: acceleration per error", "1/s/s"),
    gain("HERD_ALT_I", "altitude_i", "Height: acceleration per integral of error", "1/s/s/s"),
    gain("HERD_ALT_IMAX", "altitude_i_limit", "Height: most that the integral adds", "m/s/s"),
    gain("HERD_POS_P", "position_p", "Horizontal: acceleration per position error", "1/s/s"),
    _PAPER,
)

ROVER_BODY = grouped(
    "HERD",
    constant("HERD_MASS", "mass", "Mass", "kg"),
    constant("HERD_INERTIA", "inertia", "Moment of inertia, yaw", "kg m^2"),
    constant("HERD_WHEEL_RAD", "wheel_radius", "Radius of a wheel", "m"),
    constant("HERD_CG_OFFSET", "cg_offset", "Axle forward to centre of gravity", "m"),
    constant("HERD_DRAG_LIN", "drag_linear", "Drag over speed", "N s/m"),
    constant("HERD_DRAG_ANG", "drag_angular", "Drag torque over yaw rate", "N m s/rad"),
    constant("HERD_TORQUE_MAX", "torque_limit", "Torque limit of a wheel", "N m"),
)

ROVER_GAINS = grouped(
    "HERD",
    gain("HERD_WHEEL_P", "wheel_p", "Wheel: torque per speed error", "N m s/rad"),
    gain("HERD_WHEEL_I", "wheel_i", "Wheel: torque per integral of speed error", "N m/rad"),
    gain("HERD_ARRIVAL", "arrival_radius", "This near to a fixed target it stands", "m"),
)

HALF_TRACK = grouped("HERD", constant("HERD_HALF_TRACK", "half_track", "Axle centre to wheel", "m"))
