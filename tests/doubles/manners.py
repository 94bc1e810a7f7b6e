"""TEST DOUBLE: the manners of real autopilots that our own vehicles do not have.

`Manners` says which; `Actor` plays them on the messages that pass between one of our vehicles and
a ground station. Facts: ArduCopter and ArduRover 4.6.3, PX4 1.18, as measured. Nothing in here is
a vehicle, and no test of flight dynamics may rest on it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, hypot
from typing import NamedTuple

from mavherd.transport.frames import Origin
from mavherd.transport.mavlink import Message, mav
from mavherd.vehicles.flight.personality import PERSONALITIES
from mavherd.vehicles.protocol.rates import DEFAULT_RATES_HZ, GROUPS

_STREAMED = {*DEFAULT_RATES_HZ, *(i for ids in GROUPS.values() for i in ids)} - {0}
_OF_ALL_STREAMS = _STREAMED - {  # REQUEST_DATA_STREAM ALL does not bring these
    mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
    mav.MAVLINK_MSG_ID_HOME_POSITION,
    mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN,
    mav.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED,
}
_PUSHED = {"GPS_GLOBAL_ORIGIN", "HOME_POSITION"}  # once, unasked, when they are set
_LOCATED = {"LOCAL_POSITION_NED", "GPS_GLOBAL_ORIGIN", "HOME_POSITION"}
_POSITION_FLAGS = 0x8 | 0x10 | 0x100 | 0x200  # of EKF_STATUS_REPORT and ESTIMATOR_STATUS
_NO_POSITION, _NO_VELOCITY, _NO_ACCELERATION, _NO_YAW, _NO_YAW_RATE = 7, 0x38, 0x1C0, 0x400, 0x800
_BY_FORCE = 21196
_STILL = 0.01  # m/s
_PREARM_S = 2.0  # between two reminders; 30 in reality


@dataclass(frozen=True, kw_only=True)
class Manners:
    """What a real autopilot does and ours does not. Times are seconds of the double's clock.

    They count from the ground's first word, however long the start of both has taken.
    """

    streams_on_request: bool = True  # nothing but heartbeats and texts before (ArduPilot)
    origin_after_s: float = 0.0  # no local position, origin or home for so long
    origin_off: tuple[float, float, float] = (0.0, 0.0, 0.0)  # north, east, down of ours, m
    arming_refused_s: float = 0.0  # with a reason
    refuses_unannounced: bool = False  # the health bits say that all is well
    early_mode_lost_s: float = 0.0  # a mode set before is accepted, and put back (ArduPilot)
    position_only: bool = False  # rovers ignore velocity beside a position (ArduPilot)
    drives_while_turning: bool = False  # rovers, along the nose; velocity zero turns north
    # seconds after arming:
    silences: tuple[tuple[float, float], ...] = ()  # begin and length: nothing passes the link
    hangs_up_after_s: float | None = None  # the connection breaks; it may be called again
    disarms_after_s: float | None = None
    pilot_after_s: float | None = None  # a pilot takes over, with this mode
    pilot_mode: str = ""  # as the flight stack calls it

    def __post_init__(self) -> None:
        if (self.pilot_after_s is None) == bool(self.pilot_mode):
            raise ValueError("a pilot needs a time and a mode")


class Passed(NamedTuple):
    """What goes on to either side."""

    up: list[Message]  # to the vehicle
    down: list[Message]  # to the ground


class Actor:
    """Plays manners. `now` is seconds since the ground's first word, 0 before."""

    def __init__(self, manners: Manners, kind: str, autopilot: str) -> None:
        self.manners = manners
        self.armed = False
        self.armed_at: float | None = None  # when it was armed first
        self.modes: list[str] = []  # one after the other, as the flight stack calls them
        self.position = (0.0, 0.0, 0.0)  # of the vehicle itself: north, east, down, not shifted
        self.texts: list[str] = []
        self.targets = 0  # position targets that went to the vehicle
        is_rover = kind == "rover"
        self._drives = is_rover and manners.drives_while_turning
        self._heeds_position_only = is_rover and manners.position_only
        self._stack = autopilot
        self._table = PERSONALITIES[autopilot].modes[kind]
        self._asked: set[int] = set()
        self._once: dict[int, int] = {}
        self._pushed: set[str] = set()
        self._done: set[str] = set()
        self._yaw = 0.0
        self._prearm_at = 0.5
        self._text_id = 0

    @property
    def mode(self) -> str:
        """What it is in now."""
        return self.modes[-1] if self.modes else ""

    def connected(self) -> None:
        """Forget what the last ground station asked for: rates are per link."""
        self._asked.clear()
        self._once.clear()

    def is_silent(self, now: float) -> bool:
        """Return whether nothing passes the link now."""
        flown = self._since_arming(now)
        return any(begin <= flown < begin + length for begin, length in self.manners.silences)

    def hangs_up(self, now: float) -> bool:
        """Return true once, when the connection is to break."""
        return self._due("hang up", self.manners.hangs_up_after_s, now)

    def tick(self, now: float) -> Passed:
        """Return what happens without anybody's asking."""
        up: list[Message] = []
        m = self.manners
        if m.early_mode_lost_s and now >= m.early_mode_lost_s and "boot" not in self._done:
            self._done.add("boot")
            if not self.armed:
                up.append(self._mode(self._table.number(self._table.boot)))
        if self._due("disarm", m.disarms_after_s, now):
            up.append(_command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 0, _BY_FORCE))
        if self._due("pilot", m.pilot_after_s, now):
            numbers = {name: number for number, name in self._table.rows.values()}
            up.append(self._mode(numbers[m.pilot_mode]))
        down: list[Message] = []
        if self._refuses_arming(now) and now >= self._prearm_at and self._announces_refusal():
            self._prearm_at = now + _PREARM_S
            down += self._said("PreArm: Need Position Estimate")
        return Passed(up, down)

    def from_vehicle(self, message: Message, now: float) -> list[Message]:
        """Return what the ground gets to see of a message."""
        name = message.get_type()
        self._learn(name, message, now)
        if name in _LOCATED and now < self.manners.origin_after_s:
            return []
        if not self._is_wanted(name, message):
            return []
        match name:
            case "LOCAL_POSITION_NED" | "POSITION_TARGET_LOCAL_NED" | "HOME_POSITION":
                self._shift(message, -1)
            case "GPS_GLOBAL_ORIGIN":
                north, east, down = self.manners.origin_off
                here = Origin(message.latitude * 1e-7, message.longitude * 1e-7, 0)
                lat_deg, lon_deg = here.to_geodetic(north, east)
                message.latitude, message.longitude = round(lat_deg * 1e7), round(lon_deg * 1e7)
                message.altitude -= round(down * 1000)
            case "GLOBAL_POSITION_INT" if now < self.manners.origin_after_s:
                message.lat = message.lon = 0
            case "EKF_STATUS_REPORT" | "ESTIMATOR_STATUS" if now < self.manners.origin_after_s:
                message.flags &= ~_POSITION_FLAGS
            case "SYS_STATUS" if self._refuses_arming(now) and self._announces_refusal():
                message.onboard_control_sensors_health &= ~mav.MAV_SYS_STATUS_PREARM_CHECK
        return [message]

    def from_ground(self, message: Message, now: float) -> Passed:
        """Return what the vehicle gets to see of a message, and what is answered in its name."""
        match message.get_type():
            case "COMMAND_LONG" | "COMMAND_INT":
                return self._on_command(message, now)
            case "REQUEST_DATA_STREAM" if message.start_stop:
                self._asked |= _OF_ALL_STREAMS
            case "SET_POSITION_TARGET_LOCAL_NED":
                self._on_target(message)
        return Passed([message], [])

    def _learn(self, name: str, message: Message, now: float) -> None:
        match name:
            case "HEARTBEAT":
                self.armed = bool(message.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)
                mode = self._table.mode(message.custom_mode)
                name = self._table.name(mode) if mode else f"mode {message.custom_mode}"
                if name != self.mode:
                    self.modes.append(name)
                if self.armed and self.armed_at is None:
                    self.armed_at = now
            case "LOCAL_POSITION_NED":
                self.position = message.x, message.y, message.z
            case "ATTITUDE":
                self._yaw = message.yaw
            case "STATUSTEXT":
                self.texts.append(message.text)

    def _is_wanted(self, name: str, message: Message) -> bool:
        number = message.get_msgId()
        if not self.manners.streams_on_request or number not in _STREAMED:
            return True
        if self._once.get(number):
            self._once[number] -= 1
            return True
        if name in _PUSHED and name not in self._pushed:
            self._pushed.add(name)
            return True
        return number in self._asked

    def _on_command(self, m: Message, now: float) -> Passed:
        match m.command:
            case mav.MAV_CMD_SET_MESSAGE_INTERVAL:
                (self._asked.add if m.param2 > 0 else self._asked.discard)(int(m.param1))
            case mav.MAV_CMD_REQUEST_MESSAGE:
                self._expect(int(m.param1))
            case mav.MAV_CMD_GET_HOME_POSITION:
                self._expect(mav.MAVLINK_MSG_ID_HOME_POSITION)
            case mav.MAV_CMD_COMPONENT_ARM_DISARM if m.param1 == 1 and self._refuses_arming(now):
                return Passed([], self._refusal(m))
        return Passed([m], [])

    def _expect(self, number: int) -> None:
        self._once[number] = self._once.get(number, 0) + 1

    def _refuses_arming(self, now: float) -> bool:
        return now < self.manners.arming_refused_s

    def _announces_refusal(self) -> bool:
        """Return whether the vehicle says before it is asked that it will not arm."""
        return not self.manners.refuses_unannounced

    def _refusal(self, m: Message) -> list[Message]:
        """Return how the flight stack says that it does not arm, and why."""
        result, texts = mav.MAV_RESULT_FAILED, ["Arm: Need Position Estimate"]
        if self._stack == "px4":
            result = mav.MAV_RESULT_TEMPORARILY_REJECTED
            texts = [
                "Arming denied: Resolve system health failures first\t",
                "Preflight Fail: no heading reference\t",
            ]
        to = m.get_srcSystem(), m.get_srcComponent()
        ack = mav.MAVLink_command_ack_message(m.command, result, 0, 0, *to)
        said = [chunk for text in texts for chunk in self._said(text)]
        return [ack, *said] if self._stack == "px4" else [*said, ack]

    def _said(self, text: str) -> Iterator[Message]:
        """Yield a text in the pieces that fit."""
        self._text_id += 1
        number = self._text_id if len(text) > 50 else 0
        for part in range(0, len(text), 50):
            yield mav.MAVLink_statustext_message(
                mav.MAV_SEVERITY_CRITICAL, text[part : part + 50].encode(), number, part // 50
            )

    def _on_target(self, m: Message) -> None:
        """Let the vehicle see of a target what the real one heeds of it."""
        self.targets += 1
        has_position = not m.type_mask & _NO_POSITION
        if has_position and m.coordinate_frame == mav.MAV_FRAME_LOCAL_NED:
            self._shift(m, +1)
        if has_position and self._heeds_position_only:
            m.type_mask |= _NO_VELOCITY | _NO_ACCELERATION | _NO_YAW | _NO_YAW_RATE
            return
        velocity_alone = _NO_POSITION | _NO_ACCELERATION | _NO_YAW | _NO_YAW_RATE
        if self._drives and m.type_mask & 0xDFF == velocity_alone:
            speed = hypot(m.vx, m.vy)
            course = atan2(m.vy, m.vx) if speed > _STILL else 0.0
            if m.coordinate_frame != mav.MAV_FRAME_LOCAL_NED:
                course += self._yaw if speed > _STILL else -self._yaw
            m.coordinate_frame = mav.MAV_FRAME_LOCAL_NED
            m.vx, m.vy, m.vz, m.yaw = speed, 0.0, 0.0, course
            m.type_mask &= ~_NO_YAW

    def _shift(self, message: Message, sign: int) -> None:
        north, east, down = self.manners.origin_off
        message.x += sign * north
        message.y += sign * east
        message.z += sign * down

    def _since_arming(self, now: float) -> float:
        return -1.0 if self.armed_at is None else now - self.armed_at

    def _due(self, what: str, after_s: float | None, now: float) -> bool:
        """Return true once, when so much time has passed since arming."""
        if after_s is None or what in self._done or self._since_arming(now) < after_s:
            return False
        self._done.add(what)
        return True

    def _mode(self, number: int) -> Message:
        if self._stack == "px4":
            return _command(mav.MAV_CMD_DO_SET_MODE, 1, number >> 16 & 0xFF, number >> 24)
        return _command(mav.MAV_CMD_DO_SET_MODE, 1, number)


def _command(command: int, *params: float) -> Message:
    p = (*params, *(0,) * (7 - len(params)))
    return mav.MAVLink_command_long_message(0, 0, command, 0, *p)
