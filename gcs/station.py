"""The MAVLink client of one vehicle: what it says of itself, and what it is asked to do. No I/O.

`now` is fleet time in seconds, given by the caller. Everything here is local NED, as on the wire.
"""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from ..transport.errors import VehicleError
from ..transport.frames import Quaternion, Triple, quaternion_from_euler
from ..transport.mavlink import Codec, Message, mav

SYSTEM_ID = 254
COMPONENT_ID: int = mav.MAV_COMP_ID_MISSIONPLANNER  # 190, as MAVSDK and QGroundControl use it
RETRY_S = 0.5  # between two tries of a command
TRIES = 5
_HEARTBEAT_S = 1.0

_IGNORE_POSITION = 0x007
_IGNORE_VELOCITY = 0x038
_IGNORE_ACCELERATION = 0x1C0
_IGNORE_YAW = 0x400
_IGNORE_YAW_RATE = 0x800

Text = tuple[float, int, str]
"""Fleet time, severity and text of a STATUSTEXT."""
Texts = deque[Text]
KEPT_TEXTS = 32

Tap = Callable[[bytes, float], None]
"""Sees every frame of the link, sent or received, with fleet time."""


class StationError(VehicleError):
    """A vehicle that refuses or does not answer; the text repeats what it said."""


@dataclass(slots=True)
class Request:
    """One command on its way: `result` is None until the vehicle answers or tries run out."""

    command: int
    params: tuple[float, ...]
    what: str
    next_try: float
    heard: Texts  # what the vehicle says, as it goes on
    asked_at: float
    tries: int = 0
    result: int | None = None
    problem: str = ""

    @property
    def accepted(self) -> bool:
        """Whether the vehicle said yes."""
        return self.result == mav.MAV_RESULT_ACCEPTED

    @property
    def refused(self) -> bool:
        """Whether the vehicle said no, or nothing."""
        return bool(self.problem)

    @property
    def error(self) -> str:
        """Return why it was not done; the vehicle's own reason often comes after its answer."""
        said = [text for at, _, text in self.heard if at >= self.asked_at]
        return self.problem + (f": the vehicle says {said[-1]!r}" if said else "")


@dataclass(slots=True)
class VehicleStatus:
    """What the vehicle last said of itself (local NED, SI); times are fleet time of arrival."""

    heartbeat_at: float = -1.0
    position_at: float = -1.0
    position: Triple = (0.0, 0.0, 0.0)
    velocity: Triple = (0.0, 0.0, 0.0)
    quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)
    yaw: float = 0.0
    armed: bool = False
    custom_mode: int = 0
    texts: Texts = field(default_factory=lambda: deque(maxlen=KEPT_TEXTS))


class Station:
    """Speaks MAVLink with one vehicle: feed it bytes, take bytes from it."""

    def __init__(self, name: str, system_id: int, rate_hz: float, tap: Tap | None = None) -> None:
        self.name = name
        self.system_id = system_id
        self.status = VehicleStatus()
        self.codec = Codec(SYSTEM_ID, COMPONENT_ID)
        self._tap = tap
        self._outbox: list[Message] = []
        self._requests: dict[int, Request] = {}
        self._heartbeat_due = 0.0
        self._new_texts: list[Text] = []
        interval_us = 1e6 / rate_hz
        self._wanted_streams = {
            mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: interval_us,
            mav.MAVLINK_MSG_ID_ATTITUDE: 2 * interval_us,
            mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: -1.0,
            mav.MAVLINK_MSG_ID_VFR_HUD: -1.0,
            mav.MAVLINK_MSG_ID_GPS_RAW_INT: -1.0,
            mav.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: -1.0,
        }
        self._unanswered_streams = len(self._wanted_streams)
        self._streams_due = 0.0

    # From the vehicle

    def receive(self, data: bytes, now: float) -> None:
        """Take in what the vehicle sent."""
        for message, frame in self.codec.decode_frames(data, stream=False):
            if self._tap:
                self._tap(frame, now)
            if message.get_srcSystem() == self.system_id:
                self._take(message, now)

    def _take(self, m: Message, now: float) -> None:
        s = self.status
        match m.get_type():
            case "LOCAL_POSITION_NED":
                s.position, s.velocity = (m.x, m.y, m.z), (m.vx, m.vy, m.vz)
                s.position_at = now
            case "ATTITUDE":
                s.quaternion = quaternion_from_euler(m.roll, m.pitch, m.yaw)
                s.yaw = m.yaw
            case "HEARTBEAT":
                s.heartbeat_at = now
                s.armed = bool(m.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)
                s.custom_mode = m.custom_mode
            case "STATUSTEXT":
                text = (now, m.severity, m.text)
                s.texts.append(text)
                self._new_texts.append(text)
            case "COMMAND_ACK":
                self._on_ack(m)

    def _ask_for_streams(self, now: float) -> Iterator[Message]:
        """Yield requests for telemetry rates, again until each has been answered."""
        if self.status.heartbeat_at < 0 or not self._unanswered_streams or now < self._streams_due:
            return
        self._streams_due = now + RETRY_S
        self._unanswered_streams = len(self._wanted_streams)
        for message_id, interval_us in self._wanted_streams.items():
            yield self._command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, (message_id, interval_us))

    def _on_ack(self, m: Message) -> None:
        if m.command == mav.MAV_CMD_SET_MESSAGE_INTERVAL:
            self._unanswered_streams -= 1
            return
        request = self._requests.get(m.command)
        if request is None or m.result == mav.MAV_RESULT_IN_PROGRESS:
            return
        del self._requests[m.command]
        request.result = m.result
        if m.result != mav.MAV_RESULT_ACCEPTED:
            known = mav.enums["MAV_RESULT"].get(m.result)
            reason = known.name.removeprefix("MAV_RESULT_") if known else f"result {m.result}"
            request.problem = f"{self.name}: {request.what} refused ({reason})"

    def new_texts(self) -> list[Text]:
        """Return and forget the STATUSTEXTs since the last call."""
        taken, self._new_texts = self._new_texts, []
        return taken

    # To the vehicle

    def set_mode(self, custom_mode: int, now: float) -> Request:
        """Ask for a flight mode by its number."""
        params = (mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, custom_mode)
        return self._request(mav.MAV_CMD_DO_SET_MODE, params, f"mode {custom_mode}", now)

    def arm(self, now: float) -> Request:
        """Ask to arm."""
        return self._request(mav.MAV_CMD_COMPONENT_ARM_DISARM, (1.0,), "arming", now)

    def disarm(self, now: float) -> Request:
        """Ask to disarm."""
        return self._request(mav.MAV_CMD_COMPONENT_ARM_DISARM, (0.0,), "disarming", now)

    def take_off(self, height: float, now: float) -> Request:
        """Ask to climb to `height` metres above home."""
        params = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, height)
        return self._request(mav.MAV_CMD_NAV_TAKEOFF, params, "takeoff", now)

    def land(self, now: float) -> Request:
        """Ask to land here."""
        return self._request(mav.MAV_CMD_NAV_LAND, (), "landing", now)

    def send_target(
        self,
        now: float,
        *,
        position: Triple | None = None,
        velocity: Triple | None = None,
        acceleration: Triple | None = None,
        yaw: float | None = None,
        yaw_rate: float | None = None,
    ) -> None:
        """Send SET_POSITION_TARGET_LOCAL_NED with what is given and the rest ignored."""
        mask = 0
        mask |= _IGNORE_POSITION if position is None else 0
        mask |= _IGNORE_VELOCITY if velocity is None else 0
        mask |= _IGNORE_ACCELERATION if acceleration is None else 0
        mask |= _IGNORE_YAW if yaw is None else 0
        mask |= _IGNORE_YAW_RATE if yaw_rate is None else 0
        zero = (0.0, 0.0, 0.0)
        self._outbox.append(
            mav.MAVLink_set_position_target_local_ned_message(
                int(now * 1000) & 0xFFFFFFFF,
                self.system_id,
                mav.MAV_COMP_ID_AUTOPILOT1,
                mav.MAV_FRAME_LOCAL_NED,
                mask,
                *(position or zero),
                *(velocity or zero),
                *(acceleration or zero),
                yaw or 0.0,
                yaw_rate or 0.0,
            )
        )

    def transmit(self, now: float) -> bytes:
        """Return everything that is to be sent now: heartbeat, commands, retries, targets."""
        out: list[Message] = []
        if now >= self._heartbeat_due:
            self._heartbeat_due = now + _HEARTBEAT_S
            out.append(
                mav.MAVLink_heartbeat_message(
                    mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, mav.MAV_STATE_ACTIVE, 3
                )
            )
        for request in list(self._requests.values()):
            if now >= request.next_try:
                self._try(request, now, out)
        out += self._ask_for_streams(now)
        out += self._outbox
        self._outbox = []
        frames = self.codec.frames(out)
        if self._tap:
            for frame in frames:
                self._tap(frame, now)
        return b"".join(frames)

    def _request(self, command: int, params: tuple[float, ...], what: str, now: float) -> Request:
        request = Request(
            command, params, what, next_try=now, heard=self.status.texts, asked_at=now
        )
        self._requests[command] = request
        return request

    def _try(self, request: Request, now: float, out: list[Message]) -> None:
        if request.tries == TRIES:
            del self._requests[request.command]
            request.result = mav.MAV_RESULT_FAILED
            request.problem = f"{self.name}: no answer to {request.what} after {TRIES} tries"
            return
        out.append(self._command(request.command, request.params, request.tries))
        request.tries += 1
        request.next_try = now + RETRY_S

    def _command(self, command: int, params: tuple[float, ...], confirmation: int = 0) -> Message:
        filled = params + (0.0,) * (7 - len(params))
        return mav.MAVLink_command_long_message(
            self.system_id, mav.MAV_COMP_ID_AUTOPILOT1, command, confirmation, *filled
        )
