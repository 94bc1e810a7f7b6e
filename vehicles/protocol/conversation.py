"""One link's side of a vehicle: its codec, its rates, and who answers which message."""

from typing import TYPE_CHECKING

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

_HEARTBEAT: int = mav.MAVLINK_MSG_ID_HEARTBEAT


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
            for service in self._paced:  # nobody has told them the time yet
                service.due(self.telemetry.now_us * 1e-6)
        handler = self._handlers.get(message.get_type())
        if handler is None or not self._is_for_us(message):
            return []
        return handler(message)

    def due(self, broadcasts: list[Message]) -> list[Message]:
        """Return what is to be sent now: news for everybody, replies under way, telemetry."""
        now_us = self.telemetry.now_us
        if self._spoken:
            messages = [*broadcasts, *self._pending]
            self._pending.clear()
            now = now_us * 1e-6
            for service in self._paced:
                messages += service.due(now)
        else:
            messages = [m for m in broadcasts if m.get_msgId() == _HEARTBEAT]
        if now_us >= self.streams.next_due_us:
            made = map(self.telemetry.make, self.streams.due(now_us))
            messages += [m for m in made if m is not None]
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
        sender = message.get_srcSystem(), message.get_srcComponent()
        if sender == (self._system_id, AUTOPILOT_COMPONENT):
            return False
        settings, is_outside = self._autopilot.settings, self.channel is not None
        if settings.gcs_enforced and is_outside and sender[0] != settings.gcs_system_id:
            return False
        if getattr(message, "target_system", 0) not in (0, self._system_id):
            return False
        component = getattr(message, "target_component", 0)
        return self._any_component or component in (0, AUTOPILOT_COMPONENT)
