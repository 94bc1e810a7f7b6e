"""The MAVLink client of one vehicle. `now` is fleet time in seconds, given by the caller."""

from collections.abc import Callable
from math import isfinite
from typing import Any

from ...transport.frames import Origin, Triple
from ...transport.mavlink import AUTOPILOT_COMPONENT, Codec, Message, mav
from ...vehicles.flight.modes import Mode
from ...vehicles.flight.personality import ModeTable
from .commands import Commands, Request
from .missions import ANSWERS as MISSION_ANSWERS
from .missions import MissionClient
from .outside import Outside
from .parameters import ParameterClient
from .stacks import ARDUPILOT, FlightStack
from .status import Text, VehicleStatus
from .streams import PrivateStreams
from .targets import position_target

SYSTEM_ID = 254
COMPONENT_ID: int = mav.MAV_COMP_ID_MISSIONPLANNER  # 190, as MAVSDK and QGroundControl use it
_HEARTBEAT_S = 1.0
_HEARTBEAT: Any = mav.MAVLink_heartbeat_message
_LOCAL_NED: int = mav.MAV_FRAME_LOCAL_NED
_BODY_NED: int = mav.MAV_FRAME_BODY_NED
_NO_AUTOPILOT: int = mav.MAV_AUTOPILOT_INVALID

_ANSWERS = frozenset(("COMMAND_ACK", "PARAM_VALUE", *MISSION_ANSWERS))

Tap = Callable[[bytes, float], None]
"""Sees every frame of the link, sent or received, with fleet time."""

Listener = Callable[[Message, float], None]
"""Sees every message of the vehicle, with fleet time."""


class Station:
    """Speaks MAVLink with one vehicle: feed it bytes, take bytes from it.

    Everything on this side is NED in the fleet's frame. With an `origin`, the fleet's, the vehicle
    is an external one with a frame of its own: `status.position_at` stays as it is (-1 at first),
    and targets are not sent, while the two are not aligned. `problem` says why it must not be
    flown at all; "": nothing.
    """

    def __init__(
        self,
        name: str,
        system_id: int,
        rate_hz: float,
        tap: Tap | None = None,
        *,
        kind: str = "quadcopter",
        stack: FlightStack | None = ARDUPILOT,
        origin: Origin | None = None,
    ) -> None:
        self.name = name
        self.system_id = system_id
        self.kind = kind
        self.stack = stack  # None: not known yet
        self.status = VehicleStatus()
        self.codec = Codec(SYSTEM_ID, COMPONENT_ID)
        heard = self.status.texts
        self.parameters = ParameterClient(name, system_id, heard, stack)
        self.missions = MissionClient(name, system_id, heard, stack)
        self._commands = Commands(name, system_id, heard)
        self._outside = None if origin is None else Outside(kind, stack, origin, rate_hz)
        self._streams = PrivateStreams(
            rate_hz, altitude=stack is not None and stack.takeoff_is_amsl
        )
        self._tap = tap
        self._listeners: list[Listener] = []
        self._outbox: list[Message] = []
        self._heartbeat_due = 0.0
        self._new_texts: list[Text] = []
        self._mode: Mode | None = None  # that it is in
        self._mode_of: tuple[FlightStack | None, int] = (None, -1)  # stack and number: of that

    @property
    def external(self) -> bool:
        """Whether somebody else has started the vehicle."""
        return self._outside is not None

    @property
    def problem(self) -> str:
        """Why the vehicle must not be flown at all, with its name and the cure; "": nothing."""
        problem = self._outside.problem if self._outside else ""
        return f"{self.name}: {problem}" if problem else ""

    @property
    def waits_for(self) -> str:
        """What is missing before its positions mean something in the fleet's frame; "": nothing."""
        return self._outside.alignment.waits_for if self._outside else ""

    # From the vehicle

    def receive(self, data: bytes, now: float) -> None:
        """Take in what the vehicle sent."""
        tap = self._tap
        for message, frame in self.codec.decode_frames(data, stream=False):
            if tap:
                tap(frame, now)
            if (
                message.get_srcSystem() == self.system_id
                and message.get_srcComponent() == AUTOPILOT_COMPONENT
            ):
                self._take(message, now)

    def listen(self, handler: Listener) -> None:
        """Have `handler` called with every message of the vehicle, after we have read it."""
        self._listeners.append(handler)

    @property
    def has_new_texts(self) -> bool:
        """Whether there are STATUSTEXTs that were not taken."""
        return bool(self._new_texts)

    def new_texts(self) -> list[Text]:
        """Return and forget the STATUSTEXTs since the last call."""
        taken, self._new_texts = self._new_texts, []
        return taken

    def in_mode(self, mode: Mode) -> bool:
        """Return whether the vehicle says that it is in `mode`."""
        stack, number = self.stack, self.status.custom_mode
        if self._mode_of[1] != number or self._mode_of[0] is not stack:
            modes = self.modes
            self._mode = None if modes is None else modes.mode(number)
            self._mode_of = (stack, number)
        return self._mode is mode

    def mode_name(self, mode: Mode | None = None) -> str:
        """Return what this flight stack calls a mode, the one it is in unless one is given."""
        modes, number = self.modes, self.status.custom_mode
        mode = mode or (modes.mode(number) if modes else None)
        if mode is not None:
            return modes.name(mode) if modes and mode in modes.rows else mode.name
        return modes.refused.get(number, f"MODE {number}") if modes else f"MODE {number}"

    @property
    def modes(self) -> ModeTable | None:
        """The modes that vehicles of this kind have; None while the flight stack is not known."""
        return self.stack.modes(self.kind) if self.stack else None

    def _take(self, m: Message, now: float) -> None:
        s = self.status
        name = m.get_type()
        if name == "HEARTBEAT" and m.autopilot == _NO_AUTOPILOT:
            return  # of something beside the autopilot that shares its ids
        if text := s.hear(m, now):
            self._new_texts.append(text)
        if self._outside:
            self._hear_from_outside(m, self._outside, now)
        if name == "LOCAL_POSITION_NED":
            self._place((m.x, m.y, m.z), (m.vx, m.vy, m.vz), now)
        elif name in _ANSWERS and _is_for_us(m):  # on a link that several share
            self._hear_answer(name, m, now)
        for listener in self._listeners:
            listener(m, now)

    def _hear_answer(self, name: str, m: Message, now: float) -> None:
        if name == "COMMAND_ACK":
            self._on_ack(m, now)
        elif name == "PARAM_VALUE":
            self.parameters.hear(m, now)
        else:
            self._outbox += self.missions.hear(m, now)

    def _hear_from_outside(self, m: Message, outside: Outside, now: float) -> None:
        outside.hear(m, self.status, now)
        if self.stack is None and outside.stack is not None:
            self.stack = self.parameters.stack = self.missions.stack = outside.stack

    def _place(self, local: Triple, velocity: Triple, now: float) -> None:
        s = self.status
        x, y, z = local
        vx, vy, vz = velocity
        if not isfinite(x + y + z + vx + vy + vz):  # single floats: their sum cannot overflow
            return  # an estimator in trouble: the age of the last position tells
        if self._outside:
            alignment = self._outside.alignment
            if not alignment.aligned:
                return  # nothing new is known: the age of the last position tells
            local = alignment.to_fleet(local)
        s.position, s.velocity, s.position_at = local, velocity, now

    def _on_ack(self, m: Message, now: float) -> None:
        if self._outside or not self._streams.take_ack(m):
            self._commands.take_ack(m, now)

    # To the vehicle

    def set_mode(self, mode: Mode, now: float) -> Request:
        """Ask for a flight mode."""
        command, what = mav.MAV_CMD_DO_SET_MODE, f"mode {self.mode_name(mode)}"
        if self.stack is None or (modes := self.modes) is None:
            reason = "it has not said yet which flight stack it is"
            return self._commands.refuse(command, what, now, reason)
        if mode not in modes.rows:
            return self._commands.refuse(command, what, now, f"{modes.firmware} has no such mode")
        number = modes.number(mode)
        numbers: tuple[int, ...] = (number,)
        if self.stack.personality.sub_modes:
            numbers = (number >> 16 & 0xFF, number >> 24)
        params = (mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, *numbers)
        return self.command(command, params, what, now)

    def arm(self, now: float) -> Request:
        """Ask to arm."""
        return self.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, (1.0,), "arming", now)

    def disarm(self, now: float) -> Request:
        """Ask to disarm."""
        return self.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, (0.0,), "disarming", now)

    def take_off(self, up: float, now: float) -> Request:
        """Ask to climb to `up` metres above where it stands (ArduPilot: above home)."""
        command, what = mav.MAV_CMD_NAV_TAKEOFF, "takeoff"
        here = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        if self.stack is not None and self.stack.takeoff_is_amsl:
            place = self.status.global_position
            if place is None:
                reason = "it has not told its altitude yet"
                return self._commands.refuse(command, what, now, reason)
            nan = float("nan")
            here, up = (0.0, 0.0, 0.0, nan, nan, nan), place[2] + up
        return self.command(command, (*here, up), what, now)

    def land(self, now: float) -> Request:
        """Ask to land here."""
        return self.command(mav.MAV_CMD_NAV_LAND, (), "landing", now)

    def command(self, command: int, params: tuple[float, ...], what: str, now: float) -> Request:
        """Ask for any MAV_CMD as COMMAND_LONG; `what` names it in errors, missing params are 0."""
        return self._commands.ask(command, params, what, now)

    def send_target(
        self,
        now: float,
        *,
        body: bool = False,
        position: Triple | None = None,
        velocity: Triple | None = None,
        acceleration: Triple | None = None,
        yaw: float | None = None,
        yaw_rate: float | None = None,
    ) -> None:
        """Send SET_POSITION_TARGET_LOCAL_NED with what is given and the rest ignored.

        `body`: velocity is forward, right, down. Nothing is sent to an external vehicle before its
        frame is known, or when it is not the one that is meant.
        """
        if self._outside:
            if self._outside.problem or not self._outside.alignment.aligned:
                return
            if position is not None:
                position = self._outside.alignment.to_local(position)
        frame = _BODY_NED if body else _LOCAL_NED
        parts = (position, velocity, acceleration, yaw, yaw_rate)
        self._outbox.append(position_target(self.system_id, now, frame, *parts))

    def transmit(self, now: float) -> bytes:
        """Return everything that is to be sent now: heartbeat, commands, retries, targets."""
        out: list[Message] = []
        if now >= self._heartbeat_due:
            self._heartbeat_due = now + _HEARTBEAT_S
            out.append(_HEARTBEAT(mav.MAV_TYPE_GCS, _NO_AUTOPILOT, 0, 0, mav.MAV_STATE_ACTIVE, 3))
        if self._outside and self.status.heartbeat_at >= 0:
            out += self._outside.due(self._commands, self.status, now)
        out += self._commands.due(now)
        if self.status.heartbeat_at >= 0:
            if not self._outside:
                out += self._streams.due(self._commands, now)
            out += self.parameters.due(now)
            out += self.missions.due(now)
        out += self._outbox
        if not out:
            return b""
        self._outbox = []
        frames = self.codec.frames(out)
        if self._tap:
            for frame in frames:
                self._tap(frame, now)
        return b"".join(frames)


def _is_for_us(m: Message) -> bool:
    """Return whether an answer is meant for this station, or for everybody."""
    system, component = getattr(m, "target_system", 0), getattr(m, "target_component", 0)
    return system in (0, SYSTEM_ID) and component in (0, COMPONENT_ID)
