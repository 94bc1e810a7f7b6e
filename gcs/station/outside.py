"""What a station does besides for an external vehicle: who it is, where its frame lies."""

from collections.abc import Iterator

from ...transport.frames import Origin
from ...transport.mavlink import Message, mav
from .alignment import Alignment
from .commands import Commands
from .identity import mismatch
from .stacks import FlightStack, stack_heard
from .status import VehicleStatus
from .streams import WatchedStreams

_SILENT_S = 3.0  # nothing is asked of a vehicle that is not there
_REQUEST_MESSAGE: int = mav.MAV_CMD_REQUEST_MESSAGE
_OFTEN_S, _SELDOM_S = 1.0, 15.0  # between two requests: until it is known, and then
_TRIES = 5  # for what is good to know only


class Outside:
    """The part of a station that is for vehicles somebody else has started."""

    def __init__(self, kind: str, stack: FlightStack | None, fleet: Origin, rate_hz: float) -> None:
        self.stack = stack
        self.alignment = Alignment(fleet)
        self._kind = kind
        self._mismatch = ""
        self._streams = WatchedStreams(rate_hz)
        self._boots = 0
        self._due = dict.fromkeys(("origin", "home", "version"), 0.0)
        self._version_tries = 0

    @property
    def problem(self) -> str:
        """Why the vehicle must not be flown; "": nothing."""
        return self._mismatch or self.alignment.problem

    def hear(self, m: Message, s: VehicleStatus, now: float) -> None:
        """Take in a message that `s` has already read."""
        if s.boots != self._boots:
            self._boots = s.boots
            self._start_again(s)
        self._streams.hear(m)
        alignment, armed = self.alignment, s.armed
        match m.get_type():
            case "HEARTBEAT":
                self._identify(m)
            case "LOCAL_POSITION_NED":
                stands = not armed or self._kind == "rover"
                alignment.hear_local((m.x, m.y, m.z), (m.vx, m.vy, m.vz), now, stands=stands)
            case "GLOBAL_POSITION_INT" if m.lat or m.lon:
                alignment.hear_global(m.lat * 1e-7, m.lon * 1e-7, now, armed=armed)
            case "GPS_GLOBAL_ORIGIN" if s.origin is not None:
                alignment.hear_origin(s.origin, armed=armed)
            case "HOME_POSITION" if armed:
                alignment.hear_home(m.z)

    def due(self, commands: Commands, s: VehicleStatus, now: float) -> Iterator[Message]:
        """Have done what is to be asked now; yield what is no command."""
        if self._mismatch or now - s.heartbeat_at > _SILENT_S:
            return
        yield from self._streams.due(commands, now)
        if commands.is_asking(_REQUEST_MESSAGE):
            return
        pause = _SELDOM_S if self.alignment.aligned else _OFTEN_S
        home_pause = _OFTEN_S if s.home is None else _SELDOM_S
        if now >= self._due["origin"]:
            self._request(commands, "origin", mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, now, pause)
        elif now >= self._due["home"]:
            self._request(commands, "home", mav.MAVLINK_MSG_ID_HOME_POSITION, now, home_pause)
        elif s.version is None and self._version_tries < _TRIES and now >= self._due["version"]:
            self._version_tries += 1
            version = mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION
            self._request(commands, "version", version, now, _OFTEN_S)

    def _identify(self, m: Message) -> None:
        self._mismatch = mismatch(self._kind, self.stack, m.type, m.autopilot)
        if not self._mismatch and self.stack is None:
            self.stack = stack_heard(m.autopilot)

    def _start_again(self, s: VehicleStatus) -> None:
        s.forget()
        self._streams.restart()
        self.alignment.forget()
        self._due = dict.fromkeys(self._due, 0.0)

    def _request(
        self, commands: Commands, what: str, message_id: int, now: float, pause: float
    ) -> None:
        self._due[what] = now + pause
        commands.ask(_REQUEST_MESSAGE, (message_id,), f"its {what}", now)
