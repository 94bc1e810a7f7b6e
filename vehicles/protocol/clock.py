"""Clock comparison and echoes: TIMESYNC (mavlink.io/en/services/timesync.html) and PING."""

from collections.abc import Callable, Mapping

from ...transport.mavlink import Message, mav
from .service import Handler

_HAS_TARGET = "target_system" in mav.MAVLink_timesync_message.fieldnames  # newer dialects


class ClockService:
    """Answers TIMESYNC and, where `answers_ping`, PING. `now_us` tells the time since boot."""

    def __init__(self, now_us: Callable[[], int], *, answers_ping: bool) -> None:
        self._now_us = now_us
        self.handlers: Mapping[str, Handler] = {"TIMESYNC": self._timesync}
        if answers_ping:
            self.handlers = {**self.handlers, "PING": self._ping}

    def _timesync(self, m: Message) -> list[Message]:
        if m.tc1 != 0:
            return []  # an answer; we have not asked
        now_ns = max(1, self._now_us() * 1000)  # 0 would be a question
        target = (m.get_srcSystem(), m.get_srcComponent()) if _HAS_TARGET else ()
        return [mav.MAVLink_timesync_message(now_ns, m.ts1, *target)]

    def _ping(self, m: Message) -> list[Message]:
        if m.target_system or m.target_component:
            return []  # an answer, whoever may have asked
        sender = m.get_srcSystem(), m.get_srcComponent()
        return [mav.MAVLink_ping_message(m.time_usec, m.seq, *sender)]
