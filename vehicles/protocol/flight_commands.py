"""MAV_CMDs that make the vehicle do something; each returns a MAV_RESULT."""

from dataclasses import replace
from math import copysign, isfinite, isinf, isnan, radians

from ...transport.frames import wrap_angle, yaw_of
from ...transport.mavlink import mav
from ..flight.auto import Auto, set_mission_current, start_mission
from ..flight.autopilot import Autopilot
from ..flight.guided import Guided
from ..flight.heading import Heading
from ..flight.modes import Mode
from ..robot import Vec3
from .command import ACCEPTED, DENIED, FAILED, UNSUPPORTED, Command, FlightRow

FORCE = 21196  # the magic number that disarms in the air, and arms without checks
FORCE_ARMING = 2989  # ArduPilot's own number for the latter
_PAUSE = {0.0: True, 1.0: False}  # DO_PAUSE_CONTINUE
_REPOSITION_CHANGES_MODE = 1
_YAW_RATE = radians(60)  # of CONDITION_YAW without a rate, and the highest
_WHOLE_TURN = 360.0  # degrees
_REBOOT = 1
_UNGUIDED = (Mode.STABILIZE, Mode.ALT_HOLD, Mode.MANUAL)  # where the sticks alone set the pace


def _arm_disarm(a: Autopilot, c: Command) -> int:
    if c.params[0] == 1:
        return a.arming.arm(force=c.params[1] in (FORCE, FORCE_ARMING))
    if c.params[0] == 0:
        return a.arming.disarm(force=c.params[1] == FORCE)
    return UNSUPPORTED


def _prearm_checks(a: Autopilot, _: Command) -> int:
    return a.arming.run_checks()


def _takeoff(a: Autopilot, c: Command) -> int:
    stack, height = a.personality, c.z
    if c.frame != mav.MAV_FRAME_GLOBAL_RELATIVE_ALT and not stack.takeoff_in_any_frame:
        return DENIED
    if not c.is_global:
        return DENIED
    if stack.altitudes_are_amsl or c.is_amsl:
        height += a.home.down - a.origin.alt_m
    if stack.altitudes_are_amsl and (isnan(height) or height <= 0):
        height = a.settings.takeoff_height
        a.say(f"Using default takeoff altitude: {height:g} m")
    return a.take_off(height) if isfinite(height) else DENIED


def _set_mode(a: Autopilot, c: Command) -> int:
    if not c.whole(1) & mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
        return DENIED
    if a.personality.sub_modes:
        return a.set_mode(c.whole(2) << 16 | c.whole(3) << 24)
    return a.set_mode(c.whole(2))


def _reposition(a: Autopilot, c: Command) -> int:
    stack, speed, yaw = a.personality, c.params[0], c.params[3]
    if a.mode is not stack.reposition_mode and not c.whole(2) & _REPOSITION_CHANGES_MODE:
        return DENIED
    if isinf(speed) or isinf(yaw):
        return DENIED
    place = _place_or_here(a, c)
    if reason := a.fence.refusal(place):
        a.say(f"Reposition refused: {reason}", mav.MAV_SEVERITY_WARNING)
        return FAILED
    keeps_yaw = isnan(yaw) or (yaw == 0 and not stack.no_yaw_is_nan)
    return a.reposition(place, None if keeps_yaw else wrap_angle(yaw), speed)


def _place_or_here(a: Autopilot, c: Command) -> Vec3:
    """Return the place asked for; what is NaN (PX4's habit) stays as it is."""
    if not c.is_int and a.personality.altitudes_are_amsl:
        c = replace(c, frame=mav.MAV_FRAME_GLOBAL)
    if not (isnan(c.x) and isnan(c.y)):
        return c.place(a.origin, a.home.down)
    k = a.robot.kinematics()
    return Vec3(k.north, k.east, k.down if isnan(c.z) else c.down(a.origin, a.home.down))


def _condition_yaw(a: Autopilot, c: Command) -> int:
    if a.mode not in (Mode.GUIDED, Mode.AUTO):
        return FAILED
    angle, rate, direction = c.number_at(1), radians(c.number_at(2)), c.whole(3)
    relative = c.params[3] == 1
    if not 0 <= angle <= _WHOLE_TURN or not (relative or c.params[3] == 0):
        return FAILED
    if rate < 0 or direction not in (-1, 0, 1):
        return DENIED
    yaw = yaw_of(a.robot.kinematics()[6:10])
    target = yaw + copysign(radians(angle), direction) if relative else radians(angle)
    a.gaze.turn(Heading(yaw, target, min(rate, _YAW_RATE) or _YAW_RATE, direction))
    return ACCEPTED


def _yaw_and_speed(a: Autopilot, c: Command) -> int:
    if a.mode is not Mode.GUIDED:
        return FAILED
    yaw, speed = radians(c.number_at(1)), c.number_at(2)
    if c.params[2] > 0:
        yaw += yaw_of(a.robot.kinematics()[6:10])
    a.targets.drive(yaw, speed)
    return ACCEPTED


def _look_at(a: Autopilot, c: Command) -> int:
    if a.mode not in (Mode.GUIDED, Mode.AUTO):
        return FAILED
    a.gaze.look_at(None if c.x == c.y == 0 else c.place(a.origin, a.home.down))
    return ACCEPTED


def _look_away(a: Autopilot, _: Command) -> int:
    a.gaze.look_at(None)
    return ACCEPTED


def _change_speed(a: Autopilot, c: Command) -> int:
    kind, speed = c.whole(1), c.number_at(2)
    if speed <= 0:
        return DENIED
    stands = a.mode is Mode.HOLD and not a.flies and a.personality.reposition_mode is not Mode.HOLD
    if a.mode in _UNGUIDED or stands:
        return FAILED
    if kind in (mav.SPEED_TYPE_AIRSPEED, mav.SPEED_TYPE_GROUNDSPEED):
        a.robot.speed_limit = speed
    elif kind == mav.SPEED_TYPE_CLIMB_SPEED and a.flies:
        a.robot.climb_limit = speed
    elif kind == mav.SPEED_TYPE_DESCENT_SPEED and a.flies:
        a.robot.descent_limit = speed
    else:
        return DENIED
    return ACCEPTED


def _set_home(a: Autopilot, c: Command) -> int:
    k = a.robot.kinematics()
    if c.params[0] == 1 or c.x == c.y == 0:
        a.set_home(Vec3(k.north, k.east, k.down))
    else:
        a.set_home(c.place(a.origin, a.home.down))
    return ACCEPTED


def _mission_start(a: Autopilot, c: Command) -> int:
    return start_mission(a, c.params[0], c.params[1])


def _set_current(a: Autopilot, c: Command) -> int:
    done = set_mission_current(a, c.params[0], reset=c.params[1] == 1)
    return ACCEPTED if done else FAILED


def _pause_continue(a: Autopilot, c: Command) -> int:
    pause, behaviour = _PAUSE.get(c.number_at(1)), a.behaviour
    if pause is None:
        return DENIED
    under_way = a.armed and a.climb is None and (a.in_air or not a.flies)
    if not (under_way and isinstance(behaviour, Auto | Guided)):
        a.say(f"Failed to {'pause' if pause else 'resume'}")
        return FAILED
    behaviour.paused = pause
    return ACCEPTED


def _fence_enable(a: Autopilot, c: Command) -> int:
    return a.fence.enable(c.whole(1), c.whole(2))


def _terminate(a: Autopilot, c: Command) -> int:
    return a.arming.disarm(force=True) if c.number_at(1) > 0.5 else FAILED


def _reboot(a: Autopilot, c: Command) -> int:
    if c.params[0] != _REBOOT:
        return UNSUPPORTED
    if a.armed or a.in_air:
        a.say(f"Reboot refused: {'armed' if a.armed else 'in the air'}", mav.MAV_SEVERITY_WARNING)
        return FAILED
    a.wants_reboot = True
    return ACCEPTED


def _enter(mode: Mode) -> "FlightRow":
    return FlightRow(lambda a, _: a.enter(mode), f"changes the mode to {mode.name}")


_COPTER_ONLY = ("quadcopter",)
_ROVER_ONLY = ("rover",)

FLIGHT_COMMANDS: dict[int, FlightRow] = {
    mav.MAV_CMD_COMPONENT_ARM_DISARM: FlightRow(
        _arm_disarm,
        "param1 exactly 0 or 1, else UNSUPPORTED; param2 21196: also in the air, and without"
        " checks; 2989: arms without checks",
    ),
    mav.MAV_CMD_RUN_PREARM_CHECKS: FlightRow(_prearm_checks, "says what hinders arming"),
    mav.MAV_CMD_NAV_TAKEOFF: FlightRow(
        _takeoff,
        "param7 metres above home (COMMAND_INT: frame GLOBAL_RELATIVE_ALT only), armed, in GUIDED,"
        " LOITER or ALT_HOLD; PX4: AMSL or NaN, armed or not",
        _COPTER_ONLY,
    ),
    mav.MAV_CMD_NAV_VTOL_TAKEOFF: FlightRow(_takeoff, "as NAV_TAKEOFF", _COPTER_ONLY),
    mav.MAV_CMD_NAV_LAND: FlightRow(lambda a, _: a.enter(Mode.LAND), "lands here", _COPTER_ONLY),
    mav.MAV_CMD_NAV_VTOL_LAND: FlightRow(
        lambda a, _: a.enter(Mode.LAND), "as NAV_LAND", _COPTER_ONLY
    ),
    mav.MAV_CMD_NAV_RETURN_TO_LAUNCH: _enter(Mode.RTL),
    mav.MAV_CMD_NAV_LOITER_UNLIM: FlightRow(
        lambda a, _: a.enter(a.personality.loiter_mode),
        "changes the mode to LOITER; PX4: to HOLD",
        _COPTER_ONLY,
    ),
    mav.MAV_CMD_DO_SET_MODE: FlightRow(
        _set_mode, "param1 with CUSTOM_MODE_ENABLED, param2 custom_mode; PX4: main and sub mode"
    ),
    mav.MAV_CMD_DO_REPOSITION: FlightRow(
        _reposition,
        "goes to a place; in GUIDED (PX4: HOLD), or with param2 bit 0 from any mode; param1: speed,"
        " param4: yaw, where NaN means none, and on ArduPilot 0, too",
    ),
    mav.MAV_CMD_CONDITION_YAW: FlightRow(
        _condition_yaw,
        "turns in GUIDED or AUTO: angle 0..360, rate, direction, relative",
        _COPTER_ONLY,
    ),
    mav.MAV_CMD_NAV_SET_YAW_SPEED: FlightRow(
        _yaw_and_speed,
        "in GUIDED: heading (param3 1: relative) and speed, until GUID_TIMEOUT",
        _ROVER_ONLY,
    ),
    mav.MAV_CMD_DO_SET_ROI_LOCATION: FlightRow(
        _look_at, "points the nose at a place, in GUIDED or AUTO", _COPTER_ONLY, partly=True
    ),
    mav.MAV_CMD_DO_SET_ROI: FlightRow(
        _look_at, "as DO_SET_ROI_LOCATION; 0, 0 as DO_SET_ROI_NONE", _COPTER_ONLY, partly=True
    ),
    mav.MAV_CMD_DO_SET_ROI_NONE: FlightRow(
        _look_away, "gives the nose back", _COPTER_ONLY, partly=True
    ),
    mav.MAV_CMD_DO_CHANGE_SPEED: FlightRow(
        _change_speed, "horizontal, climb or descent speed until the mode changes"
    ),
    mav.MAV_CMD_DO_SET_HOME: FlightRow(_set_home, "here (param1 = 1, or 0, 0) or at a place"),
    mav.MAV_CMD_MISSION_START: FlightRow(
        _mission_start,
        "enters AUTO; param1: first item; param2: 0 or the last one, else DENIED",
        partly=True,
    ),
    mav.MAV_CMD_DO_SET_MISSION_CURRENT: FlightRow(
        _set_current, "param1: item; param2 = 1 forgets jumps and what is done"
    ),
    mav.MAV_CMD_DO_PAUSE_CONTINUE: FlightRow(
        _pause_continue,
        "AUTO and GUIDED: param1 0 stops and holds, 1 goes on; not while taking off",
    ),
    mav.MAV_CMD_DO_FENCE_ENABLE: FlightRow(
        _fence_enable, "param1: 0 off, 1 on, 2 floor off; param2: mask of FENCE_TYPE, 0 all"
    ),
    mav.MAV_CMD_DO_FLIGHTTERMINATION: FlightRow(_terminate, "stops the motors at once"),
    mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: FlightRow(
        _reboot,
        "param1 = 1 while disarmed on the ground: new parameters count, time begins anew;"
        " else UNSUPPORTED",
        partly=True,
    ),
}
"""Every command that moves the vehicle or its state; others are UNSUPPORTED."""
