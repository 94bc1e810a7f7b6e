"""Missions of one vehicle: lists that go up, and how far it has come with them."""

from collections.abc import Sequence
from dataclasses import dataclass

from ...transport.frames import Origin, Triple
from ...transport.mavlink import Message, mav
from .commands import RETRY_S, TRIES
from .question import Question
from .stacks import FlightStack
from .status import Texts

_HOME_FRAME: int = mav.MAV_FRAME_GLOBAL
_RELATIVE: int = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
_COMPLETE: int = mav.MISSION_STATE_COMPLETE
_TYPE: int = mav.MAV_MISSION_TYPE_MISSION
ANSWERS = (
    "MISSION_REQUEST",
    "MISSION_REQUEST_INT",
    "MISSION_ACK",
    "MISSION_CURRENT",
    "MISSION_ITEM_REACHED",
)
"""The messages that `MissionClient.hear` makes something of."""


@dataclass(frozen=True, slots=True)
class MissionItem:
    """One item, as MISSION_ITEM_INT has it; heights are above home."""

    command: int
    lat_deg: float = 0.0
    lon_deg: float = 0.0
    up: float = 0.0  # m
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


def plan(
    points: Sequence[Triple], kind: str, origin: Origin, ground: float = 0.0
) -> tuple[MissionItem, ...]:
    """Return the mission through `points` (east, north, up from the fleet origin).

    A quadcopter first takes off to the height of the first point; PX4 goes there once it is up,
    wherever a takeoff is said to be. `ground` is the height of home.
    """
    nan = float("nan")
    items = []
    for number, (east, north, up) in enumerate(points):
        lat_deg, lon_deg = origin.to_geodetic(north, east)
        height = up - ground if kind == "quadcopter" else 0.0
        where = (lat_deg, lon_deg, height)
        keep_yaw = (0.0, 0.0, 0.0, nan)
        if number == 0 and kind == "quadcopter":
            items.append(MissionItem(mav.MAV_CMD_NAV_TAKEOFF, *where, keep_yaw))
        items.append(MissionItem(mav.MAV_CMD_NAV_WAYPOINT, *where, keep_yaw))
    return tuple(items)


@dataclass(slots=True)
class _Upload:
    question: Question
    items: tuple[MissionItem, ...]
    next_try: float
    tries: int = 0


@dataclass(slots=True)
class MissionClient:
    """Sends missions up and follows their progress.

    `current`, `reached` and `count` number the items as they were given, from 0: that a list of
    ArduPilot begins with home is a matter between it and us. None and -1: not told, none yet.
    """

    name: str
    system_id: int
    heard: Texts
    stack: FlightStack | None = None
    current: int | None = None
    reached: int = -1
    count: int = 0
    _ended: bool = False  # as it says
    _upload: _Upload | None = None

    def upload(self, items: Sequence[MissionItem], now: float) -> Question:
        """Put a list in the place of the vehicle's; none at all clears it."""
        question = Question(f"mission of {len(items)} items", self.heard, now)
        if self._upload:
            self._end(f"overtaken by {question.what}")
        self._upload = _Upload(question, tuple(items), next_try=now)
        return question

    def clear(self, now: float) -> Question:
        """Have the vehicle forget its mission."""
        return self.upload((), now)

    def hear(self, m: Message, now: float) -> list[Message]:
        """Take in one of `ANSWERS`; return what it asks for."""
        match m.get_type():
            case "MISSION_REQUEST" | "MISSION_REQUEST_INT":
                return self._on_request(m, now)
            case "MISSION_ACK":
                self._on_ack(m)
            case "MISSION_CURRENT":
                self.current = m.seq - self._home_items
                self._ended = m.mission_state == _COMPLETE
            case "MISSION_ITEM_REACHED":
                self.reached = m.seq - self._home_items
        return []

    def due(self, now: float) -> list[Message]:
        """Return what is to be sent or sent again now."""
        upload = self._upload
        if upload is None or now < upload.next_try or self.stack is None:
            return []
        if upload.tries == TRIES:
            self._end(f"no answer after {TRIES} tries")
            return []
        upload.tries += 1
        upload.next_try = now + 2 * RETRY_S
        to = (self.system_id, mav.MAV_COMP_ID_AUTOPILOT1)
        if upload.items:
            return [mav.MAVLink_mission_count_message(*to, self._length(upload), _TYPE)]
        return [mav.MAVLink_mission_clear_all_message(*to, _TYPE)]

    @property
    def complete(self) -> bool:
        """Whether the vehicle is through with the list that went up last."""
        return self._ended or 0 < self.count <= self.reached + 1

    @property
    def _home_items(self) -> int:
        return 1 if self.stack is not None and self.stack.needs_home_item else 0

    def _length(self, upload: _Upload) -> int:
        return len(upload.items) + self._home_items

    def _on_request(self, m: Message, now: float) -> list[Message]:
        upload = self._upload
        if upload is None or not upload.items or m.mission_type != _TYPE:
            return []
        if not 0 <= m.seq < self._length(upload):
            return []
        upload.tries, upload.next_try = 1, now + TRIES * RETRY_S  # it has heard of the list
        seq = m.seq - self._home_items
        item = upload.items[max(0, seq)]
        command, frame, up = item.command, _RELATIVE, item.up
        if seq < 0:  # a place holder: it puts its own there
            command, frame, up = mav.MAV_CMD_NAV_WAYPOINT, _HOME_FRAME, 0.0
        head = (self.system_id, mav.MAV_COMP_ID_AUTOPILOT1, m.seq, frame, command, m.seq == 0, 1)
        x, y = round(item.lat_deg * 1e7), round(item.lon_deg * 1e7)
        params = item.params if seq >= 0 else (0.0, 0.0, 0.0, 0.0)
        return [mav.MAVLink_mission_item_int_message(*head, *params, x, y, up, _TYPE)]

    def _on_ack(self, m: Message) -> None:
        upload = self._upload
        if upload is None or m.mission_type != _TYPE:
            return
        if m.type == mav.MAV_MISSION_INVALID_SEQUENCE:
            return  # it goes on with the item that it wants
        if m.type != mav.MAV_MISSION_ACCEPTED:
            known = mav.enums["MAV_MISSION_RESULT"].get(m.type)
            word = known.name.removeprefix("MAV_MISSION_") if known else f"result {m.type}"
            self._end(f"refused ({word})")
            return
        self.count, self.reached, self._ended = len(upload.items), -1, False
        upload.question.accepted = True
        upload.question.value = float(self.count)
        self._upload = None

    def _end(self, reason: str) -> None:
        upload, self._upload = self._upload, None
        if upload:
            upload.question.problem = f"{self.name}: {upload.question.what}: {reason}"
