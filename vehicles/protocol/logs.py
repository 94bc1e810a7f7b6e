"""The log download protocol of a vehicle that keeps no logs on board: it says so."""

from collections.abc import Mapping

from ...transport.mavlink import Message, mav
from .service import Handler


class LogService:
    """Answers LOG_REQUEST_LIST with "none".

    There is nothing to send, erase or end, and the protocol has no refusal: silence for these.
    """

    def __init__(self) -> None:
        self.handlers: Mapping[str, Handler] = {"LOG_REQUEST_LIST": self._list}

    def _list(self, m: Message) -> list[Message]:
        none = mav.MAVLink_log_entry_message(id=0, num_logs=0, last_log_num=0, time_utc=0, size=0)
        return [none]
