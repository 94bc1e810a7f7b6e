"""MAVLink requests to one vehicle: every command is answered, UNSUPPORTED where we do not."""

from collections.abc import Callable
from math import isfinite

from ...transport.mavlink import AUTOPILOT_COMPONENT, Message, mav
from ..flight.autopilot import ACCEPTED, DENIED, Autopilot
from ..flight.modes import Mode
from .streams import Streams
from .telemetry import Telemetry

UNSUPPORTED: int = mav.MAV_RESULT_UNSUPPORTED
FAILED: int = mav.MAV_RESULT_FAILED
_FORCE = 21196  # the magic number that disarms in the air

Params = tuple[float, ...]
Answer = tuple[int, list[Message]]


class Commands:
    """Answers what one link says to the vehicle."""

    def __init__(self, autopilot: Autopilot, telemetry: Telemetry) -> None:
        self._autopilot = autopilot
        self._telemetry = telemetry
        self._system_id = autopilot.config.system_id
        self._commands: dict[int, Callable[[Params, Streams], Answer]] = {
            mav.MAV_CMD_COMPONENT_ARM_DISARM: self._arm_disarm,
            mav.MAV_CMD_NAV_TAKEOFF: self._takeoff,
            mav.MAV_CMD_NAV_LAND: lambda p, s: self._enter(Mode.LAND),
            mav.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda p, s: self._enter(Mode.RTL),
            mav.MAV_CMD_DO_SET_MODE: self._set_mode,
            mav.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            mav.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_interval,
            mav.MAV_CMD_REQUEST_MESSAGE: lambda p, s: self._send_once(p[0]),
            mav.MAV_CMD_GET_HOME_POSITION: lambda p, s: self._send_once(
                mav.MAVLINK_MSG_ID_HOME_POSITION
            ),
            mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: lambda p, s: self._send_once(
                mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION
            ),
        }

    def handle(self, message: Message, streams: Streams) -> list[Message]:
        """React to one message from the ground and return the replies to its sender's link."""
        sender = message.get_srcSystem(), message.get_srcComponent()
        if sender == (self._system_id, AUTOPILOT_COMPONENT) or not self._is_for_me(message):
            return []  # our own words come back, or somebody else is meant
        match message.get_type():
            case "SET_POSITION_TARGET_LOCAL_NED" | "SET_POSITION_TARGET_GLOBAL_INT":
                self._autopilot.follow(message)
                return []
            case "COMMAND_LONG" | "COMMAND_INT":
                return self._on_command(message, streams)
            case "SET_MODE":  # legacy; ArduPilot obeys and sends no ACK
                self._set_mode((message.base_mode, message.custom_mode), streams)
                return []
        return []

    def _is_for_me(self, message: Message) -> bool:
        system = getattr(message, "target_system", 0)
        component = getattr(message, "target_component", 0)
        return system in (0, self._system_id) and component in (0, AUTOPILOT_COMPONENT)

    def _on_command(self, m: Message, streams: Streams) -> list[Message]:
        if m.get_type() == "COMMAND_INT":  # x and y are degrees, 1e-7, or plain numbers
            params: Params = (m.param1, m.param2, m.param3, m.param4, m.x, m.y, m.z)
        else:
            params = (m.param1, m.param2, m.param3, m.param4, m.param5, m.param6, m.param7)
        run = self._commands.get(m.command)
        result, replies = run(params, streams) if run else (UNSUPPORTED, [])
        ack = mav.MAVLink_command_ack_message(
            m.command,
            result,
            target_system=m.get_srcSystem(),
            target_component=m.get_srcComponent(),
        )
        return [ack, *replies]

    def _arm_disarm(self, p: Params, _: Streams) -> Answer:
        if p[0] == 1:
            return self._autopilot.arm(), []
        if p[0] == 0:
            return self._autopilot.disarm(force=p[1] == _FORCE), []
        return DENIED, []

    def _takeoff(self, p: Params, _: Streams) -> Answer:
        if not self._autopilot.flies:
            return UNSUPPORTED, []
        return self._autopilot.take_off(p[6]), []

    def _enter(self, mode: Mode) -> Answer:
        if mode not in self._autopilot.identity.modes:
            return UNSUPPORTED, []
        self._autopilot.change_mode(mode)
        return ACCEPTED, []

    def _set_mode(self, p: Params, _: Streams) -> Answer:
        if not (isfinite(p[0]) and isfinite(p[1])):
            return DENIED, []
        if not int(p[0]) & mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            return UNSUPPORTED, []
        return self._autopilot.set_mode(int(p[1])), []

    def _set_interval(self, p: Params, streams: Streams) -> Answer:
        message_id, interval_us = p[0], p[1]
        if not (isfinite(message_id) and isfinite(interval_us)):
            return DENIED, []
        if not streams.offers(int(message_id)):
            return FAILED, []
        streams.set_interval(int(message_id), interval_us, self._telemetry.now_us)
        return ACCEPTED, []

    def _get_interval(self, p: Params, streams: Streams) -> Answer:
        if not isfinite(p[0]) or not streams.offers(int(p[0])):
            return FAILED, []
        message_id = int(p[0])
        interval = streams.interval_us(message_id)
        return ACCEPTED, [mav.MAVLink_message_interval_message(message_id, interval)]

    def _send_once(self, message_id: float) -> Answer:
        message = self._telemetry.make(int(message_id)) if isfinite(message_id) else None
        return (ACCEPTED, [message]) if message else (FAILED, [])
