"""What all tests share: repeatable hypothesis runs, a vehicle on a desk, ports that are held."""

import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from math import hypot

import pytest
from hypothesis import HealthCheck, settings

from mavherd.transport.frames import yaw_of
from mavherd.transport.mavlink import Codec, Message, mav
from mavherd.vehicles.config import SLICE_US, VehicleConfig
from mavherd.vehicles.vehicle import Vehicle

settings.register_profile(
    "mavherd",
    deadline=None,  # a loaded machine is not a failure
    derandomize=True,  # neither is bad luck
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("mavherd")

# Tests send these to processes, which inherit what nohup or a shell's & has them ignore.
for signum, usual in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
    if signal.getsignal(signum) is signal.SIG_IGN:
        signal.signal(signum, usual)


class Desk:
    """One vehicle in memory and the ground end of one link to it; time passes in `run` only."""

    GROUND = 255, 190

    def __init__(self, kind: str = "quadcopter", system_id: int = 1, **config: object) -> None:
        self.vehicle = Vehicle(VehicleConfig(kind=kind, system_id=system_id, **config))
        self.autopilot = self.vehicle.autopilot
        self.link = self.vehicle.converse(spoken=True)
        self.codec = Codec(*self.GROUND)
        self.guided = 4 if kind == "quadcopter" else 15

    @property
    def now(self) -> float:
        return self.vehicle.now_us * 1e-6

    @property
    def where(self):
        return self.vehicle.robot.kinematics()

    @property
    def speed(self) -> float:
        """Metres a second, in whatever direction."""
        k = self.where
        return hypot(k.v_north, k.v_east, k.v_down)

    @property
    def yaw(self) -> float:
        return yaw_of(self.where[6:10])

    def send(self, *messages: Message) -> list[Message]:
        """Send from the ground; return what the vehicle answers at once."""
        return self.codec.decode(self.vehicle.handle(self.codec.encode(messages), self.link))

    def frames(self, seconds: float) -> Iterator[bytes]:
        """Let time pass; yield what the vehicle sends on the link, slice by slice."""
        for _ in range(round(seconds * 1e6 / SLICE_US)):
            self.vehicle.step()
            yield self.vehicle.report(self.link, self.vehicle.take_broadcasts())

    def run(self, seconds: float) -> list[Message]:
        """Let time pass; return what the vehicle has sent."""
        return [m for data in self.frames(seconds) for m in self.codec.decode(data)]

    def command(self, command: int, *params: float, sent_as: str = "long", frame: int = 3) -> int:
        """Send a command; return the result in its one ACK."""
        answers = self.ask(command, *params, sent_as=sent_as, frame=frame)
        (ack,) = (m for m in answers if _is_ack(m))
        assert ack.command == command
        return ack.result

    def ask(
        self, command: int, *params: float, sent_as: str = "long", frame: int = 3
    ) -> list[Message]:
        """Send a command; return everything that is answered at once. `frame`: of COMMAND_INT."""
        p = (*params, *(0,) * (7 - len(params)))
        system = self.vehicle.config.system_id
        if sent_as == "long":
            return self.send(mav.MAVLink_command_long_message(system, 1, command, 0, *p))
        x, y = int(p[4]), int(p[5])
        return self.send(
            mav.MAVLink_command_int_message(system, 1, frame, command, 0, 0, *p[:4], x, y, p[6])
        )

    def mode(self, name: str) -> int:
        """Ask for a mode by the name that ground stations show; return the result."""
        rows = self.autopilot.modes.rows.values()
        numbers = {shown: number for number, shown in rows}
        numbers |= {shown: number for number, shown in self.autopilot.modes.refused.items()}
        main, sub = numbers[name], 0
        if self.autopilot.personality.sub_modes:
            main, sub = numbers[name] >> 16 & 0xFF, numbers[name] >> 24
        return self.command(mav.MAV_CMD_DO_SET_MODE, 1, main, sub)

    def arm(self) -> int:
        """Ask for arming; return the result."""
        return self.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)

    def stream(self, message: Message, seconds: float, every: float = 0.1) -> list[Message]:
        """Send the same message again and again, as clients do; return what came back."""
        out = []
        for _ in range(round(seconds / every)):
            out += self.send(message)
            out += self.run(every)
        return out

    def target(self, mask: int, frame: int = 1, **fields: float) -> Message:
        """Return a SET_POSITION_TARGET_LOCAL_NED with these fields and the rest zero."""
        names = ("x", "y", "z", "vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate")
        return mav.MAVLink_set_position_target_local_ned_message(
            0, self.vehicle.config.system_id, 1, frame, mask, *(fields.pop(n, 0.0) for n in names)
        )

    def fly(self, height: float = 3.0) -> None:
        """Arm in GUIDED, and take off where that is possible."""
        assert self.command(mav.MAV_CMD_DO_SET_MODE, 1, self.guided) == mav.MAV_RESULT_ACCEPTED
        assert self.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mav.MAV_RESULT_ACCEPTED
        if self.autopilot.flies:
            climb = (0, 0, 0, 0, 0, 0, height)
            assert self.command(mav.MAV_CMD_NAV_TAKEOFF, *climb) == mav.MAV_RESULT_ACCEPTED
            self.run(3 + height)
            assert abs(self.where.down + height - self.autopilot.home.down) < 0.25


def _is_ack(m: Message) -> bool:
    return m.get_type() == "COMMAND_ACK"


@pytest.fixture(scope="session")
def desk() -> type[Desk]:
    """Make a vehicle on a desk: desk("rover", seed=3)."""
    return Desk


@pytest.fixture
def quad(desk: type[Desk]) -> Desk:
    return desk("quadcopter")


@pytest.fixture
def rover(desk: type[Desk]) -> Desk:
    return desk("rover")


@pytest.fixture
def hold_port() -> Iterator[Callable[[], int]]:
    """Return a TCP port that the system gives to nobody who asks for any: hold_port().

    Who is told of it can listen there; as long as nobody does, callers are refused.
    """
    with ExitStack() as held:

        def hold() -> int:
            sock = held.enter_context(socket.socket())
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # who listens sets it, too
            sock.bind(("127.0.0.1", 0))
            port: int = sock.getsockname()[1]
            return port

        yield hold


@pytest.fixture
def of():
    """Return the messages of one name: of(messages, "HEARTBEAT")."""

    def pick(messages: list[Message], name: str) -> list[Message]:
        return [m for m in messages if m.get_type() == name]

    return pick


@pytest.fixture
def texts():
    """Return the STATUSTEXTs among messages."""

    def pick(messages: list[Message]) -> list[str]:
        return [m.text for m in messages if m.get_type() == "STATUSTEXT"]

    return pick
