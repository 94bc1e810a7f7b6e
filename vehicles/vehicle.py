"""One vehicle, sans I/O: messages and time in, messages out. Same inputs, same bytes."""

from ..transport.mavlink import Codec, Message, mav
from .flight.autopilot import Autopilot
from .build import make_robot
from .protocol.commands import Commands
from .config import SLICE_US, VehicleConfig
from .robot import Robot
from .protocol.streams import Streams
from .protocol.telemetry import Telemetry

_HEARTBEAT: int = mav.MAVLINK_MSG_ID_HEARTBEAT


class Conversation:
    """What the vehicle keeps for each link: a codec of its own and the rates its peer asked for."""

    def __init__(self, system_id: int, now_us: int, *, spoken: bool) -> None:
        self.codec = Codec(system_id)
        self.streams = Streams(now_us, system_id, spoken=spoken)


class Vehicle:
    """Physics, controllers and autopilot of one robot, advanced 10 ms at a time."""

    def __init__(self, config: VehicleConfig) -> None:
        self.config = config
        self.robot: Robot = make_robot(config)
        self.autopilot = Autopilot(config, self.robot)
        self.telemetry = Telemetry(self.autopilot, self.robot)
        self.commands = Commands(self.autopilot, self.telemetry)
        self.now_us = 0
        self._steps = round(SLICE_US * 1e-6 / self.robot.dt)
        self._control_phase = 0
        self.autopilot.broadcast_heartbeat()

    def converse(self, *, spoken: bool = False) -> Conversation:
        """Open a conversation with a new link."""
        return Conversation(self.config.system_id, self.now_us, spoken=spoken)

    def handle(self, data: bytes, link: Conversation, *, stream: bool = False) -> bytes:
        """React to bytes from one link; return the bytes of the replies to it."""
        replies: list[Message] = []
        for message in link.codec.decode(data, stream=stream):
            if not link.streams.spoken:
                link.streams.heard(self.now_us)
            replies += self.commands.handle(message, link.streams)
        return link.codec.encode(replies) if replies else b""

    def step(self) -> None:
        """Advance by one slice of 10 ms."""
        robot, autopilot = self.robot, self.autopilot
        setpoint, every = autopilot.setpoint, robot.control_every
        for _ in range(self._steps):
            if self._control_phase == 0:
                robot.control(setpoint)
                self._control_phase = every
            self._control_phase -= 1
            robot.advance()
        self.now_us += SLICE_US
        self.telemetry.now_us = self.now_us
        autopilot.update(self.now_us * 1e-6)

    def take_broadcasts(self) -> list[Message]:
        """Return and forget what is for every link: heartbeats on a change, STATUSTEXT."""
        taken, self.autopilot.broadcasts = self.autopilot.broadcasts, []
        return taken

    def report(self, link: Conversation, broadcasts: list[Message]) -> bytes:
        """Return the bytes due on one link now."""
        streams = link.streams
        messages = (
            broadcasts if streams.spoken else [m for m in broadcasts if m.get_msgId() == _HEARTBEAT]
        )
        if self.now_us >= streams.next_due_us:
            made = map(self.telemetry.make, streams.due(self.now_us))
            messages = messages + [m for m in made if m is not None]
        return link.codec.encode(messages) if messages else b""
