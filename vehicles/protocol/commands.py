"""COMMAND_LONG, COMMAND_INT and SET_MODE: every command is answered, at least UNSUPPORTED."""

from collections.abc import Callable
from dataclasses import dataclass

from ...transport.mavlink import Message, mav
from ..flight.autopilot import Autopilot
from .command import ACCEPTED, DENIED, FAILED, UNSUPPORTED, Command, Refused
from .flight_commands import FLIGHT_COMMANDS
from .service import Handler
from .streams import Streams
from .telemetry import Telemetry

Answer = tuple[int, list[Message]]


class CommandService:
    """Answers commands that come over one link."""

    def __init__(self, autopilot: Autopilot, telemetry: Telemetry, streams: Streams) -> None:
        self._autopilot = autopilot
        self._telemetry = telemetry
        self._streams = streams
        self.handlers: dict[str, Handler] = {
            "COMMAND_LONG": self._on_command,
            "COMMAND_INT": self._on_command,
            "SET_MODE": self._on_set_mode,
        }

    def _on_command(self, m: Message) -> list[Message]:
        try:
            result, replies = self._run(Command.read(m))
        except Refused as refusal:
            result, replies = refusal.result, []
        return [_ack(m, m.command, result), *replies]

    def _run(self, c: Command) -> Answer:
        if row := FLIGHT_COMMANDS.get(c.number):
            if self._autopilot.config.kind not in row.kinds:
                return UNSUPPORTED, []
            return row.run(self._autopilot, c), []
        link_row = LINK_COMMANDS.get(c.number)
        if link_row and (self._autopilot.personality.legacy_requests or not link_row.is_legacy):
            return link_row.run(self, c)
        return UNSUPPORTED, []

    def _on_set_mode(self, m: Message) -> list[Message]:
        """Obey the legacy SET_MODE; ArduPilot sends no ACK for it."""
        custom = m.base_mode & mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        result = self._autopilot.set_mode(m.custom_mode) if custom else DENIED
        if not self._autopilot.personality.acks_set_mode:
            return []
        return [_ack(m, mav.MAV_CMD_DO_SET_MODE, result)]

    # What concerns this link only

    def set_interval(self, c: Command) -> Answer:
        """Answer SET_MESSAGE_INTERVAL."""
        message_id, interval_us = c.whole(1), c.number_at(2)
        stack = self._autopilot.personality
        if not self._streams.offers(message_id):
            if text := stack.unknown_interval_text.format(message_id):
                self._autopilot.say(text, mav.MAV_SEVERITY_WARNING, topic="interval")
            return stack.unknown_interval_refusal, []
        if not self._streams.set_interval(message_id, interval_us, self._telemetry.now_us):
            return DENIED, []
        return ACCEPTED, []

    def get_interval(self, c: Command) -> Answer:
        """Answer GET_MESSAGE_INTERVAL."""
        message_id = c.whole(1)
        known = 0 <= message_id <= _HIGHEST_ID
        if not known:
            return FAILED, []
        offered = self._streams.offers(message_id)
        interval = self._streams.interval_us(message_id) if offered else 0  # 0: not available
        return ACCEPTED, [mav.MAVLink_message_interval_message(message_id, interval)]

    def send_once(self, message_id: int, index: float = 0.0) -> Answer:
        """Answer a request for one message; `index` chooses among several."""
        messages = self._telemetry.request(message_id, index)
        if not messages:
            return self._autopilot.personality.unknown_message_refusal, []
        return ACCEPTED, messages


_HIGHEST_ID = 0xFFFF  # what MESSAGE_INTERVAL can name


@dataclass(frozen=True, slots=True)
class LinkRow:
    """A command about one link: what answers it, and what the docs say."""

    run: Callable[[CommandService, Command], Answer]
    note: str
    is_legacy: bool = False


LINK_COMMANDS: dict[int, LinkRow] = {
    mav.MAV_CMD_SET_MESSAGE_INTERVAL: LinkRow(
        CommandService.set_interval,
        "for this link; -1 stops, 0 restores the default; HEARTBEAT: 0..5 s",
    ),
    mav.MAV_CMD_GET_MESSAGE_INTERVAL: LinkRow(
        CommandService.get_interval, "answers MESSAGE_INTERVAL"
    ),
    mav.MAV_CMD_REQUEST_MESSAGE: LinkRow(
        lambda s, c: s.send_once(c.whole(1), c.params[1]),
        "sends it once; FAILED (PX4: DENIED) for one that we do not have",
    ),
    mav.MAV_CMD_GET_HOME_POSITION: LinkRow(
        lambda s, c: s.send_once(mav.MAVLINK_MSG_ID_HOME_POSITION),
        "sends HOME_POSITION; not px4",
        is_legacy=True,
    ),
    mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: LinkRow(
        lambda s, c: s.send_once(mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION),
        "sends AUTOPILOT_VERSION; not px4",
        is_legacy=True,
    ),
}
"""Every command that concerns the link it came on."""


def _ack(m: Message, command: int, result: int) -> Message:
    message: Message = mav.MAVLink_command_ack_message(
        command,
        result,
        target_system=m.get_srcSystem(),
        target_component=m.get_srcComponent(),
    )
    return message
