"""Motors: what they are told, as pulse widths and shares, and how fast they turn.

Outputs are numbered as ArduPilot does. The quadcopter is its frame QUAD/PLUS: motor 1 right,
2 left, 3 front, 4 rear (our rotors 2, 4, 1, 3; the spins agree). The rover is its skid-steering
one: output 1 left, output 3 right.
"""

from math import pi

from ....transport.extra_messages import esc_status
from ....transport.mavlink import Message, mav
from .view import View, uint16

_PLUS = (1, 3, 0, 2)  # which of our rotors ArduPilot's motors 1 to 4 are
_SKID = (0, None, 1, None)  # which wheel outputs 1 to 4 drive
_ORDER: dict[str, tuple[int | None, ...]] = {"quadcopter": _PLUS, "rover": _SKID}
_REST_US = {"quadcopter": 1000, "rover": 1500}
_SPAN_US = {"quadcopter": 1000, "rover": 500}
_PER_MINUTE = 60 / (2 * pi)
_OUTPUTS = 32  # of ACTUATOR_OUTPUT_STATUS


def throttle(v: View) -> float:
    """Return the thrust told to the rotors, or the speed to the wheels, as a share: 0..1."""
    outputs = v.robot.outputs()
    total = 0.0  # added up one by one, since `sum` rounds otherwise from Python 3.12 on
    for share in outputs:
        total += share * share if v.autopilot.flies else share
    return min(1.0, abs(total) / len(outputs))


def servo_output_raw(v: View) -> Message:
    """Make SERVO_OUTPUT_RAW: microseconds, 0 where nothing is connected."""
    message: Message = mav.MAVLink_servo_output_raw_message(
        v.now_us & 0xFFFFFFFF, 0, *_pulses(v), 0, 0, 0, 0
    )
    return message


def actuator_output_status(v: View) -> Message:
    """Make ACTUATOR_OUTPUT_STATUS: the same pulses, as PX4 sends them."""
    pulses = _pulses(v)
    active = sum(1 << i for i, width in enumerate(pulses) if width)
    padded = [float(width) for width in pulses] + [0.0] * (_OUTPUTS - len(pulses))
    message: Message = mav.MAVLink_actuator_output_status_message(v.now_us, active, padded)
    return message


def actuator_control_target(v: View) -> Message:
    """Make ACTUATOR_CONTROL_TARGET: roll, pitch, yaw and thrust before the mixer, -1..1."""
    outputs = v.robot.outputs()
    if v.autopilot.flies:
        front, right, rear, left = (share * share for share in outputs)
        roll, pitch = (left - right) / 2, (front - rear) / 2
        yaw = (right - front + left - rear) / 4
        thrust = (front + right + rear + left) / 4
    else:
        left, right = outputs
        roll = pitch = 0.0
        yaw, thrust = (left - right) / 2, (left + right) / 2
    message: Message = mav.MAVLink_actuator_control_target_message(
        v.now_us, 0, [roll, pitch, yaw, thrust, 0.0, 0.0, 0.0, 0.0]
    )
    return message


def esc_telemetry(v: View) -> Message:
    """Make ESC_TELEMETRY_1_TO_4; the motors share the battery's current evenly."""
    rpm, battery = _rpm(v), v.autopilot.battery
    motors = sum(turns is not None for turns in rpm)
    each = [turns is not None for turns in rpm]
    message: Message = mav.MAVLink_esc_telemetry_1_to_4_message(
        [0] * 4,
        [uint16(battery.voltage * 100) * on for on in each],
        [uint16(battery.current * 100 / motors) * on for on in each],
        [uint16(battery.consumed_mah / motors) * on for on in each],
        [uint16(abs(turns or 0.0)) for turns in rpm],
        [v.now_us // 10_000 % 65536 * on for on in each],
    )
    return message


def esc_status_1_to_4(v: View) -> Message:
    """Make ESC_STATUS, the common form of the same."""
    rpm, battery = _rpm(v), v.autopilot.battery
    motors = sum(turns is not None for turns in rpm)
    each = [float(turns is not None) for turns in rpm]
    return esc_status(
        0,
        v.now_us,
        [round(turns or 0.0) for turns in rpm],
        [battery.voltage * on for on in each],
        [battery.current / motors * on for on in each],
    )


def _pulses(v: View) -> list[int]:
    """Return the pulse widths of outputs 1 to 4."""
    kind, outputs = v.autopilot.config.kind, v.robot.outputs()
    rest, span = _REST_US[kind], _SPAN_US[kind]
    return [0 if i is None else rest + round(span * outputs[i]) for i in _ORDER[kind]]


def _rpm(v: View) -> list[float | None]:
    """Return turns per minute behind outputs 1 to 4, None where there is no motor."""
    speeds = v.robot.actuators()
    return [None if i is None else speeds[i] * _PER_MINUTE for i in _ORDER[v.autopilot.config.kind]]
