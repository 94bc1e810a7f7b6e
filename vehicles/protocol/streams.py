"""Which telemetry a link gets, and when: one `Streams` for each link."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from ...transport.mavlink import mav
from ..config import SLICE_US
from .rates import Rates

if TYPE_CHECKING:
    from .telemetry import Telemetry

_HEARTBEAT: int = mav.MAVLINK_MSG_ID_HEARTBEAT
_SLOWEST_HEARTBEAT_US = 5_000_000  # by heartbeats the next client finds the vehicle
_LONGEST_US = 2**31 - 1  # what MESSAGE_INTERVAL can say
_SLOW_US = 500_000  # from here on, vehicles take turns
_REVIEW_US = 1_000_000  # between two looks at the parameters
_NEVER_US = 1 << 62


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
        self._interval_us: dict[int, int] = {}  # of what is sent
        self._due_us: dict[int, int] = {}
        self._asked: set[int] = set()  # messages whose rate the peer has chosen
        self._review_us = self.next_due_us = telemetry.now_us
        self._review(telemetry.now_us)
        self._reschedule()

    def offers(self, message_id: int) -> bool:
        """Return whether this is a message that can be streamed."""
        return self._telemetry.offers(message_id)

    def interval_us(self, message_id: int) -> int:
        """Return the interval of a message, -1 when it is not sent."""
        return self._interval_us.get(message_id, -1)

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
        self._due_us = {m: max(due, now_us) for m, due in self._due_us.items()}
        self._reschedule()

    def due(self, now_us: int) -> list[int]:
        """Return the ids of the messages to send now and schedule their next time."""
        if now_us < self.next_due_us:
            return []
        if now_us >= self._review_us:
            self._review(now_us)
        ready = []
        for message_id, due_us in self._due_us.items():
            if due_us <= now_us and (self.spoken or message_id == _HEARTBEAT):
                ready.append(message_id)
                interval = self._interval_us[message_id]
                following = due_us + interval
                self._due_us[message_id] = following if following > now_us else now_us + interval
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
            self._interval_us.pop(message_id, None)
            self._due_us.pop(message_id, None)
            return
        interval = int(min(max(SLICE_US, interval_us), _LONGEST_US))
        if self._interval_us.get(message_id) == interval:
            return
        self._interval_us[message_id] = interval
        slow = interval >= _SLOW_US
        offset = (self._stagger + message_id * SLICE_US) % interval if slow else 0
        self._due_us[message_id] = now_us + offset

    def _reschedule(self) -> None:
        if self.spoken:
            self.next_due_us = min(self._review_us, min(self._due_us.values(), default=_NEVER_US))
        else:
            self.next_due_us = self._due_us.get(_HEARTBEAT, _NEVER_US)
