"""Which telemetry a link gets, and when: one `Streams` for each link."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

from ...transport.mavlink import mav
from ..config import SLICE_US
from .rates import Rates

if TYPE_CHECKING:
    from .telemetry import Telemetry

_HEARTBEAT: Final[int] = mav.MAVLINK_MSG_ID_HEARTBEAT
_SLOWEST_HEARTBEAT_US: Final = 5_000_000  # by heartbeats the next client finds the vehicle
_LONGEST_US: Final = 2**31 - 1  # what MESSAGE_INTERVAL can say
_SLOW_US: Final = 500_000  # from here on, vehicles take turns
_REVIEW_US: Final = 1_000_000  # between two looks at the parameters
_NEVER_US: Final = 1 << 62


class _Stream:
    """One message that is sent: every `interval_us`, and next at `due_us`."""

    def __init__(self, interval_us: int, due_us: int) -> None:
        self.interval_us = interval_us
        self.due_us = due_us


class Streams:
    """Intervals and due times of one link, in microseconds of vehicle time.

    `spoken` false: heartbeats only, as on a port where nobody has answered yet. `channel` says
    which SRn_... parameters count, None: no such.
    """

    def __init__(self, telemetry: "Telemetry", channel: int | None, *, spoken: bool) -> None:
        self.spoken = spoken
        self._telemetry = telemetry
        self._rates = Rates(telemetry.autopilot, channel)
        self._stagger = telemetry.autopilot.config.system_id * 7 % 50 * 2 * SLICE_US
        self._streams: dict[int, _Stream] = {}  # what is sent
        self._asked: set[int] = set()  # messages whose rate the peer has chosen
        self._review_us = self.next_due_us = telemetry.now_us
        self._review(telemetry.now_us)
        self._reschedule()

    def offers(self, message_id: int) -> bool:
        """Return whether this is a message that can be streamed."""
        return self._telemetry.offers(message_id)

    def interval_us(self, message_id: int) -> int:
        """Return the interval of a message, -1 when it is not sent."""
        stream = self._streams.get(message_id)
        return -1 if stream is None else stream.interval_us

    def set_interval(self, message_id: int, interval_us: float, now_us: int) -> bool:
        """Send a message every `interval_us`; 0 restores its default, a negative one stops it.

        False, and nothing changes, for a heartbeat that would stop or be rarer than every 5 s.
        """
        if message_id == _HEARTBEAT and not 0 <= interval_us <= _SLOWEST_HEARTBEAT_US:
            return False
        if interval_us == 0:
            self._asked.discard(message_id)
            interval_us = self._default_us(message_id)
        else:
            self._asked.add(message_id)
        self._set(message_id, interval_us, now_us)
        self._reschedule()
        return True

    def ask(self, group: Iterable[int], rate_hz: float) -> None:
        """Send the messages of a group so often from now on; 0 stops them."""
        interval_us = 1e6 / rate_hz if rate_hz else -1
        for message_id in self._rates.among(group):
            if self.offers(message_id):
                self.set_interval(message_id, interval_us, self._telemetry.now_us)

    def heard(self, now_us: int) -> None:
        """Start the default streams: the peer has spoken for the first time."""
        self.spoken = True
        for stream in self._streams.values():
            stream.due_us = max(stream.due_us, now_us)
        self._reschedule()

    def due(self, now_us: int) -> list[int]:
        """Return the ids of the messages to send now and schedule their next time."""
        if now_us < self.next_due_us:
            return []
        if now_us >= self._review_us:
            self._review(now_us)
        ready: list[int] = []
        first_us = self._review_us
        for message_id, stream in self._streams.items():
            due_us = stream.due_us
            if due_us <= now_us and (self.spoken or message_id == _HEARTBEAT):
                ready.append(message_id)
                due_us += stream.interval_us
                if due_us <= now_us:
                    due_us = now_us + stream.interval_us
                stream.due_us = due_us
            if due_us < first_us:
                first_us = due_us
        self.next_due_us = first_us
        if not self.spoken:
            self._reschedule()
        return ready

    def _review(self, now_us: int) -> None:
        """Take up what parameters say of messages that the peer has not asked for."""
        self._review_us = now_us + _REVIEW_US
        if not self._rates.have_changed():
            return
        for message_id in self._rates.messages:
            if message_id not in self._asked and self.offers(message_id):
                self._set(message_id, self._default_us(message_id), now_us)

    def _default_us(self, message_id: int) -> float:
        rate = self._rates.hz(message_id)
        return 1e6 / rate if rate else -1

    def _set(self, message_id: int, interval_us: float, now_us: int) -> None:
        """Set the interval of a message; one that stays the same keeps its due time.

        Slow messages of different vehicles are spread over time, so that a hundred heartbeats
        do not fall on one tick.
        """
        if interval_us < 0:
            self._streams.pop(message_id, None)
            return
        interval = int(min(max(SLICE_US, interval_us), _LONGEST_US))
        stream = self._streams.get(message_id)
        if stream is not None and stream.interval_us == interval:
            return
        slow = interval >= _SLOW_US
        offset = (self._stagger + message_id * SLICE_US) % interval if slow else 0
        if stream is None:
            self._streams[message_id] = _Stream(interval, now_us + offset)
        else:
            stream.interval_us, stream.due_us = interval, now_us + offset

    def _reschedule(self) -> None:
        if self.spoken:
            dues = (stream.due_us for stream in self._streams.values())
            self.next_due_us = min(self._review_us, min(dues, default=_NEVER_US))
        else:
            heartbeat = self._streams.get(_HEARTBEAT)
            self.next_due_us = heartbeat.due_us if heartbeat else _NEVER_US
