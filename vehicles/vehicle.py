"""One vehicle, sans I/O: messages and time in, messages out. Same inputs, same bytes."""

from dataclasses import replace

from ..transport.frames import yaw_of
from ..transport.mavlink import Message
from .build import make_robot
from .config import SLICE_US, VehicleConfig
from .flight.autopilot import Autopilot
from .flight.personality import PERSONALITIES
from .flight.settings import Settings
from .missions.store import MissionStore
from .parameters.live import show_lists, show_statistics
from .parameters.metadata import parameter_json
from .parameters.pack import pack
from .parameters.store import Parameters
from .protocol.component_metadata import COMPONENT_METADATA, component_metadata
from .protocol.conversation import Conversation
from .protocol.ftp_tree import GENERAL, GENERAL_URI, file_crc, vehicle_files
from .protocol.telemetry import Telemetry
from .robot import Robot


class Vehicle:
    """Physics, controllers and autopilot of one robot, advanced 10 ms at a time."""

    robot: Robot
    autopilot: Autopilot
    telemetry: Telemetry
    _steps: int  # of physics in a slice
    _control_phase: int  # steps until the next control

    def __init__(self, config: VehicleConfig) -> None:
        self.config = config
        self.now_us = 0
        self.boots = 0
        self.settings = Settings()
        self.parameters = Parameters(config, self.settings)
        home_is_item_0 = PERSONALITIES[config.autopilot].home_is_item_0
        self.missions = MissionStore(config.kind, home_is_item_0=home_is_item_0)
        show_lists(self.parameters, self.missions)
        show_statistics(self.parameters, self)
        self.files = vehicle_files(
            lambda query: pack(
                self.parameters,
                with_defaults=bool(query.get("withdefaults")),
                start=query.get("start", 0),
                count=query.get("count", 0),
            ),
            lambda: parameter_json(self.parameters),
        )
        self._boot(config)

    def converse(self, *, spoken: bool = False, channel: int | None = 0) -> Conversation:
        """Open a conversation with a new link; SR0_... parameters count on channel 0."""
        return Conversation(self, spoken=spoken, channel=channel)

    def handle(self, data: bytes, link: Conversation, *, stream: bool = False) -> bytes:
        """React to bytes from one link; return the bytes of the replies to it."""
        replies: list[Message] = []
        for message in link.codec.decode(data, stream=stream):
            replies += self.hear(message, link)
        return link.codec.encode(replies) if replies else b""

    def hear(self, message: Message, link: Conversation) -> list[Message]:
        """React to one message from one link; return the replies to it."""
        if link.boot != self.boots:
            link.begin(self)
        return link.handle(message)

    def step(self) -> None:
        """Advance by one slice of 10 ms."""
        if self.autopilot.wants_reboot:
            self._reboot()
        robot, autopilot = self.robot, self.autopilot
        setpoint, every = autopilot.setpoint, robot.control_every
        for _ in range(self._steps):
            if self._control_phase == 0:
                robot.control(setpoint)
                self._control_phase = every
            self._control_phase -= 1
            robot.advance()
        self.now_us += SLICE_US
        now_us = self.telemetry.now_us = self.telemetry.now_us + SLICE_US
        autopilot.update(now_us * 1e-6)

    def take_broadcasts(self) -> list[Message]:
        """Return and forget what is for every link: news of the vehicle, and STATUSTEXT."""
        speaker = self.autopilot.speaker
        if not (speaker.waiting or speaker.urgent):
            return []
        made = map(self.telemetry.make, sorted(speaker.urgent))
        speaker.urgent.clear()
        return [*speaker.take(), *(m for m in made if m is not None)]

    def report(self, link: Conversation, broadcasts: list[Message]) -> bytes:
        """Return the bytes due on one link now."""
        if link.boot != self.boots:
            link.begin(self)
        messages = link.due(broadcasts)
        return link.codec.encode(messages) if messages else b""

    def _boot(self, config: VehicleConfig) -> None:
        """Start robot and autopilot with the parameters as they are; time begins at 0."""
        self.robot = make_robot(replace(config, params=self.parameters.robot_overrides))
        self.parameters.bind(self.robot)
        self.autopilot = Autopilot(
            config, self.robot, self.parameters, self.settings, self.missions
        )
        self.telemetry = Telemetry(self.autopilot, self.robot)
        self.telemetry.add(COMPONENT_METADATA, self._component_metadata)
        self._steps = round(SLICE_US * 1e-6 / self.robot.dt)
        self._control_phase = 0

    def _component_metadata(self) -> Message:
        general = self.files.read(GENERAL) or b""
        return component_metadata(self.telemetry.now_us // 1000, GENERAL_URI, file_crc(general))

    def _reboot(self) -> None:
        """Boot again where the vehicle stands: body parameters count, all else is forgotten."""
        k = self.robot.kinematics()
        self.boots += 1
        self.missions.rest()
        self._boot(
            replace(
                self.config,
                north=k.north,
                east=k.east,
                down=k.down,
                yaw=yaw_of(k[6:10]),
                epoch_us=self.config.epoch_us + self.now_us,
            )
        )
