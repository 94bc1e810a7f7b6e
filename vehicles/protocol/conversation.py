"""One link's side of a vehicle: its codec, its rates, and who answers which message."""

from typing import TYPE_CHECKING, Final

from ...transport.mavlink import AUTOPILOT_COMPONENT, Codec, Message, mav
from .clock import ClockService
from .commands import CommandService
from .ftp import FtpService
from .ftp_tree import PARAMETER_PACK
from .logs import LogService
from .missions import MissionService
from .parameters import ParameterService
from .rates import RateService
from .service import Handler, PacedService, Service
from .steering import SteeringService
from .streams import Streams

if TYPE_CHECKING:
    from ..vehicle import Vehicle

_HEARTBEAT: Final[int] = mav.MAVLINK_MSG_ID_HEARTBEAT


class Conversation:
    """What the vehicle keeps for each link; made anew when the vehicle reboots."""

    def __init__(self, vehicle: "Vehicle", *, spoken: bool, channel: int | None) -> None:
        self.codec = Codec(vehicle.config.system_id)
        self.channel = channel
        self._spoken = spoken
        self.begin(vehicle)

    def begin(self, vehicle: "Vehicle") -> None:
        """Start from scratch, as the vehicle has."""
        autopilot, telemetry = vehicle.autopilot, vehicle.telemetry
        self.boot = vehicle.boots
        self._system_id = vehicle.config.system_id
        self._any_component = autopilot.personality.answers_any_component
        self.telemetry = telemetry
        self.streams = Streams(telemetry, self.channel, spoken=self._spoken)
        self._paced: list[PacedService] = [
            ParameterService(
                vehicle.parameters,
                autopilot.speaker.broadcast,
                lambda text: autopilot.say(text, mav.MAV_SEVERITY_WARNING),
                bytewise=autopilot.personality.bytewise_parameters,
                on_list=self._introduce,
            ),
            MissionService(autopilot),
            FtpService(vehicle.files, self._opened),
        ]
        services: list[Service] = [
            *self._paced,
            CommandService(autopilot, telemetry, self.streams),
            SteeringService(autopilot),
            RateService(self.streams),
            ClockService(lambda: telemetry.now_us, answers_ping=autopilot.personality.answers_ping),
            LogService(),
        ]
        self._busy = False  # paced services: else they have nothing to send, and not heard the time
        self._rousing = {name for service in self._paced for name in service.handlers}
        self._pending: list[Message] = []
        self._autopilot = autopilot
        self._handlers: dict[str, Handler] = {}
        for service in services:
            self._handlers.update(service.handlers)

    @property
    def spoken(self) -> bool:
        """Whether the peer has said anything sensible."""
        return self._spoken

    @property
    def heeds(self) -> frozenset[str]:
        """Return the names of the messages that something comes of."""
        return frozenset(self._handlers)

    def handle(self, message: Message) -> list[Message]:
        """React to one message from the ground and return the replies."""
        if not self._spoken:
            self._spoken = True
            self.streams.heard(self.telemetry.now_us)
        name = message.get_type()
        handler = self._handlers.get(name)
        if handler is None or not self._is_for_us(message):
            return []
        if name in self._rousing and not self._busy:
            self._busy = True
            for service in self._paced:  # nobody has told them the time for a while
                service.due(self.telemetry.now_us * 1e-6)
        return handler(message)

    def due(self, broadcasts: list[Message]) -> list[Message]:
        """Return what is to be sent now: news for everybody, replies under way, telemetry."""
        now_us, streams = self.telemetry.now_us, self.streams
        is_time = now_us >= streams.next_due_us
        if not (is_time or self._busy or broadcasts):
            return []
        if self._spoken:
            messages = [*broadcasts, *self._go_on()] if self._busy else broadcasts.copy()
        else:
            messages = [m for m in broadcasts if m.get_msgId() == _HEARTBEAT]
        if is_time:
            for message_id in streams.due(now_us):
                message = self.telemetry.make(message_id)
                if message is not None:
                    messages.append(message)
        return messages

    def _go_on(self) -> list[Message]:
        """Return what paced services send now."""
        messages = self._pending
        self._pending = []
        now = self.telemetry.now_us * 1e-6
        for service in self._paced:
            messages += service.due(now)
        self._busy = any(service.busy for service in self._paced)
        return messages

    def _introduce(self) -> None:
        """Say what this is on this link, as ArduPilot does when parameters are listed.

        And the version: DroneKit asks for it with a second's delay, and our list is there sooner.
        """
        self._pending = self.telemetry.request(mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        self._pending += [
            mav.MAVLink_statustext_message(mav.MAV_SEVERITY_INFO, text.encode())
            for text in self._autopilot.introduction()
        ]

    def _opened(self, path: str) -> None:
        if path.startswith(PARAMETER_PACK):
            self._introduce()

    def _is_for_us(self, message: Message) -> bool:
        """Return whether a message is not our own echo and means us, or everybody."""
        system = message.get_srcSystem()
        if system == self._system_id and message.get_srcComponent() == AUTOPILOT_COMPONENT:
            return False
        if self.channel is not None:
            settings = self._autopilot.settings
            if settings.gcs_enforced and system != settings.gcs_system_id:
                return False
        target = message.target_system
        if target and target != self._system_id:
            return False
        component = message.target_component
        return not component or component == AUTOPILOT_COMPONENT or self._any_component
