"""What the estimator says of itself: it knows the truth, and says so."""

from ....transport.mavlink import Message, mav
from .sensors import imu
from .view import View, euler, int16, uint16

_FLAGS = (
    mav.ESTIMATOR_ATTITUDE
    | mav.ESTIMATOR_VELOCITY_HORIZ
    | mav.ESTIMATOR_VELOCITY_VERT
    | mav.ESTIMATOR_POS_HORIZ_REL
    | mav.ESTIMATOR_POS_HORIZ_ABS
    | mav.ESTIMATOR_POS_VERT_ABS
    | mav.ESTIMATOR_PRED_POS_HORIZ_REL
    | mav.ESTIMATOR_PRED_POS_HORIZ_ABS
)  # 831; EKF_STATUS_REPORT has the same bits


def ekf_status_report(_: View) -> Message:
    """Make EKF_STATUS_REPORT."""
    message: Message = mav.MAVLink_ekf_status_report_message(_FLAGS, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return message


def estimator_status(v: View) -> Message:
    """Make ESTIMATOR_STATUS."""
    message: Message = mav.MAVLink_estimator_status_message(
        v.now_us, _FLAGS, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    )
    return message


def ahrs(_: View) -> Message:
    """Make AHRS: no drift and no error."""
    message: Message = mav.MAVLink_ahrs_message(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return message


def ahrs2(v: View) -> Message:
    """Make AHRS2: the second estimator agrees."""
    k = v.k
    message: Message = mav.MAVLink_ahrs2_message(
        *euler(k), v.altitude(k.down), *v.geodetic_e7(k.north, k.east)
    )
    return message


def simstate(v: View) -> Message:
    """Make SIMSTATE: the truth."""
    k, felt = v.k, imu(v)
    message: Message = mav.MAVLink_simstate_message(
        *euler(k), *felt.acceleration, *felt.rates, *v.geodetic_e7(k.north, k.east)
    )
    return message


def hil_state_quaternion(v: View) -> Message:
    """Make HIL_STATE_QUATERNION: the truth, as PX4's simulations send it."""
    k, felt = v.k, imu(v)
    airspeed = uint16((k.v_north**2 + k.v_east**2 + k.v_down**2) ** 0.5 * 100)
    message: Message = mav.MAVLink_hil_state_quaternion_message(
        v.now_us,
        [k.qw, k.qx, k.qy, k.qz],
        k.roll_rate,
        k.pitch_rate,
        k.yaw_rate,
        *v.geodetic_e7(k.north, k.east),
        round(v.altitude(k.down) * 1e3),
        int16(k.v_north * 100),
        int16(k.v_east * 100),
        int16(k.v_down * 100),
        airspeed,
        airspeed,
        *felt.scaled()[:3],
    )
    return message
