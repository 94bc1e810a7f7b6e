"""What the autopilot says to everybody: STATUSTEXT without flooding, and news of every kind."""

from ...transport.mavlink import Message, mav

_CHUNK = 50  # characters in a STATUSTEXT
_INTERVAL = 1.0  # s between two texts on one topic
_REPEAT = 0.1  # s between equal texts without one: each refusal has its reason
_MAX_TOPICS = 32  # different texts within that time


class Speaker:
    """Collects messages for every link; the process takes them every 10 ms."""

    def __init__(self) -> None:
        self.waiting: list[Message] = []
        self.urgent: set[int] = set()  # telemetry (message ids) that everybody shall have now
        self._said_at: dict[str, float] = {}
        self._id = 0

    def say(self, text: str, severity: int, topic: str, now: float) -> None:
        """Send a STATUSTEXT: once a second on a topic, ten times without one the same text.

        Text beyond 50 characters goes out in chunks that carry an id (MAVLink 2); a chunk with
        room left is the last one.
        """
        pause = _INTERVAL if topic else _REPEAT
        topic = topic or text
        if now - self._said_at.get(topic, -_INTERVAL) < pause:
            return
        if len(self._said_at) >= _MAX_TOPICS:
            self._said_at = {t: at for t, at in self._said_at.items() if now - at < _INTERVAL}
            if len(self._said_at) >= _MAX_TOPICS:
                return
        self._said_at[topic] = now
        data = text.encode("ascii", "replace")
        text_id, end = 0, len(data)
        if len(data) > _CHUNK:
            text_id = self._id = self._id % 0xFFFF + 1
            end += 1  # so that whole chunks are followed by an empty one
        for number, start in enumerate(range(0, max(end, 1), _CHUNK)):
            chunk = data[start : start + _CHUNK]
            self.waiting.append(mav.MAVLink_statustext_message(severity, chunk, text_id, number))

    def broadcast(self, message: Message) -> None:
        """Send a message to everybody; of each kind of state only the newest waits."""
        if message.get_type() in ("HEARTBEAT", "HOME_POSITION", "MISSION_CURRENT"):
            kind = message.get_type()
            self.waiting = [m for m in self.waiting if m.get_type() != kind]
        self.waiting.append(message)

    def take(self) -> list[Message]:
        """Return and forget what waits."""
        taken, self.waiting = self.waiting, []
        return taken
