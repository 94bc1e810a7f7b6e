"""The mission protocol: lists come up and go down one item at a time (mavlink.io, "Mission").

One `MissionService` for each link; the lists, and the one upload that may be under way over all
links, are the vehicle's `MissionStore`.
"""

from collections.abc import Sequence

from ...transport.mavlink import Message, mav
from ..flight.auto import set_mission_current
from ..flight.autopilot import Autopilot
from ..flight.legs import place_of
from ..flight.modes import Mode
from ..flight.position_target import IllegalTarget
from ..missions.checks import check_list
from ..missions.items import AMSL, Item, MissionType, from_message, to_int_frame
from ..missions.supported import is_located
from ..missions.upload import Sender, Upload
from .service import Handler

ACCEPTED: int = mav.MAV_MISSION_ACCEPTED
ERROR: int = mav.MAV_MISSION_ERROR
UNSUPPORTED: int = mav.MAV_MISSION_UNSUPPORTED
NO_SPACE: int = mav.MAV_MISSION_NO_SPACE
INVALID_SEQUENCE: int = mav.MAV_MISSION_INVALID_SEQUENCE
DENIED: int = mav.MAV_MISSION_DENIED
CANCELLED: int = mav.MAV_MISSION_OPERATION_CANCELLED

_ALL: int = mav.MAV_MISSION_TYPE_ALL
_WAYPOINT: int = mav.MAV_CMD_NAV_WAYPOINT
_GUIDED, _ALTITUDE = 2, 3  # MISSION_ITEM.current: go there now, change the height now
_RECEIVED = {
    MissionType.MISSION: "Flight plan received",
    MissionType.FENCE: "Fence received",
    MissionType.RALLY: "Rally points received",
}


class MissionService:
    """Answers what one link says about missions, fences and rally points."""

    def __init__(self, autopilot: Autopilot) -> None:
        self._autopilot = autopilot
        self._store = autopilot.missions
        self._asks_int = autopilot.personality.asks_with_mission_request_int
        self.handlers: dict[str, Handler] = {
            "MISSION_COUNT": self._on_count,
            "MISSION_ITEM": self._on_item,
            "MISSION_ITEM_INT": self._on_item,
            "MISSION_WRITE_PARTIAL_LIST": self._on_partial,
            "MISSION_ACK": self._on_ack,
            "MISSION_REQUEST_LIST": self._on_list,
            "MISSION_REQUEST": self._on_request,
            "MISSION_REQUEST_INT": self._on_request,
            "MISSION_REQUEST_PARTIAL_LIST": lambda m: [_ack(m, UNSUPPORTED)],
            "MISSION_CLEAR_ALL": self._on_clear,
            "MISSION_SET_CURRENT": self._on_set_current,
        }

    @property
    def busy(self) -> bool:
        """Whether somebody on this link uploads."""
        upload = self._store.upload
        return upload is not None and upload.sender.link is self

    def due(self, now: float) -> list[Message]:
        """Ask again for an item that has not come; give up when nothing comes at all."""
        upload = self._store.upload
        if upload is None or upload.sender.link is not self:
            return []
        if upload.is_stale(now):
            self._store.upload = None
            self._autopilot.say(
                f"{upload.mission_type.name.capitalize()} upload timeout", mav.MAV_SEVERITY_WARNING
            )
            to, kind = upload.sender, upload.mission_type
            return [mav.MAVLink_mission_ack_message(to.system, to.component, CANCELLED, kind)]
        return [self._request(upload)] if upload.asks_again(now) else []

    # Up

    def _on_count(self, m: Message) -> list[Message]:
        kind, refusal = self._may_write(m)
        if kind is None:
            return refusal
        home = self._home_count(kind)
        if m.count - home > (limit := self._store.lists[kind].limit):
            text = f"Only {limit + home} items are supported"
            self._autopilot.say(text, mav.MAV_SEVERITY_WARNING, "no space")
            return [_ack(m, NO_SPACE)]
        return self._begin(m, Upload(self._sender(m), kind, 0, m.count - 1, self._autopilot.now))

    def _on_partial(self, m: Message) -> list[Message]:
        kind, refusal = self._may_write(m)
        if kind is None:
            return refusal
        first, last = m.start_index, m.end_index
        count = len(self._store.lists[kind]) + self._home_count(kind)
        room = last - self._home_count(kind) < self._store.lists[kind].limit
        if not (0 <= first <= last <= count and room):
            return [_ack(m, ERROR)]
        upload = Upload(self._sender(m), kind, first, last, self._autopilot.now, partial=True)
        return self._begin(m, upload)

    def _may_write(self, m: Message) -> tuple[MissionType | None, list[Message]]:
        """Return the list that a sender may write now, or None and the refusal."""
        kind = _mission_type(m)
        if kind is None:
            return None, [_ack(m, UNSUPPORTED)]
        upload = self._under_way()
        if upload is not None and upload.sender != self._sender(m):
            return None, [_ack(m, DENIED)]
        return kind, []

    def _begin(self, m: Message, upload: Upload) -> list[Message]:
        self._store.upload = upload
        return self._finish(m, upload) if upload.complete else [self._request(upload)]

    def _on_item(self, m: Message) -> list[Message]:
        item = from_message(m, located=is_located(m.command))
        if m.current in (_GUIDED, _ALTITUDE):
            return [_ack(m, self._guide(item, height_only=m.current == _ALTITUDE))]
        upload = self._under_way()
        if upload is None or upload.mission_type != m.mission_type:
            return [_ack(m, ERROR)]
        if upload.sender != self._sender(m):
            return [_ack(m, DENIED)]
        if m.seq != upload.wanted:
            if upload.is_repeated(m.seq, item):
                return []
            return [_ack(m, INVALID_SEQUENCE)]
        is_home = m.seq < self._home_count(upload.mission_type)  # ours counts
        result = ACCEPTED if is_home else self._store.check(item, upload.mission_type)
        if result != ACCEPTED:
            self._store.upload = None
            return [_ack(m, result)]
        upload.take(item, self._autopilot.now)
        return self._finish(m, upload) if upload.complete else [self._request(upload)]

    def _finish(self, m: Message, upload: Upload) -> list[Message]:
        """Put the new list in the place of the old one."""
        self._store.upload = None
        kind, home = upload.mission_type, self._home_count(upload.mission_type)
        items: Sequence[Item] = upload.items
        if upload.partial:
            old = (*(Item(_WAYPOINT),) * home, *self._store.lists[kind].items)
            items = (*old[: upload.first], *items, *old[upload.last + 1 :])
        items = items[home:]
        if problem := check_list(items, kind):
            self._autopilot.say(problem.capitalize(), mav.MAV_SEVERITY_WARNING)
            return [_ack(m, ERROR)]
        self._store.replace(kind, items)
        if kind is MissionType.MISSION and not upload.partial and not self._is_flying_it():
            self._store.progress.begin_again()
        self._autopilot.say(_RECEIVED[kind])
        return [_ack(m, ACCEPTED)]

    def _request(self, upload: Upload) -> Message:
        make = (
            mav.MAVLink_mission_request_int_message
            if self._asks_int
            else mav.MAVLink_mission_request_message
        )
        to = upload.sender
        message: Message = make(to.system, to.component, upload.wanted, upload.mission_type)
        return message

    def _on_ack(self, m: Message) -> list[Message]:
        """Call an upload off when its sender says so; the end of a download needs nothing."""
        upload = self._store.upload
        if upload is not None and upload.sender == self._sender(m) and m.type != ACCEPTED:
            self._store.upload = None
        return []

    # Down

    def _on_list(self, m: Message) -> list[Message]:
        kind = _mission_type(m)
        if kind is None:
            return [_ack(m, UNSUPPORTED)]
        if self._is_coming_up(kind):
            return [_ack(m, DENIED)]
        count = len(self._store.lists[kind]) + self._home_count(kind)
        return [mav.MAVLink_mission_count_message(*_to(m), count, kind)]

    def _on_request(self, m: Message) -> list[Message]:
        kind = _mission_type(m)
        if kind is None:
            return [_ack(m, UNSUPPORTED)]
        if self._is_coming_up(kind):
            return [_ack(m, DENIED)]
        home = self._home_count(kind)
        if m.seq < home:
            item = self._home_item()
        elif m.seq - home < len(self._store.lists[kind]):
            item = self._store.lists[kind].items[m.seq - home]
        else:
            return [_ack(m, INVALID_SEQUENCE)]
        shown = self._store.progress.shown
        current = kind is MissionType.MISSION and shown is not None and m.seq - home == shown
        head = (*_to(m), m.seq)
        if m.get_type() == "MISSION_REQUEST":
            scale = 1e-7 if is_located(item.command) else 1.0
            return [
                mav.MAVLink_mission_item_message(
                    *head, item.frame, item.command, current, item.autocontinue, *item[2:6],
                    item.x * scale, item.y * scale, item.z, kind,
                )
            ]  # fmt: skip
        frame = to_int_frame(item.frame) if self._asks_int else item.frame
        return [
            mav.MAVLink_mission_item_int_message(
                *head, frame, item.command, current, item.autocontinue, *item[2:6],
                item.x, item.y, item.z, kind,
            )
        ]  # fmt: skip

    # Else

    def _on_clear(self, m: Message) -> list[Message]:
        kinds = [kind for kind in MissionType if m.mission_type in (kind, _ALL)]
        if not kinds:
            return [_ack(m, UNSUPPORTED)]
        mission = MissionType.MISSION in kinds
        if self._under_way() is not None or (mission and self._is_flying_it()):
            return [_ack(m, ERROR)]
        for kind in kinds:
            self._store.replace(kind, ())
        if mission:
            self._store.progress.begin_again()
        return [_ack(m, ACCEPTED)]

    def _on_set_current(self, m: Message) -> list[Message]:
        """Go on with another item; the answer is MISSION_CURRENT, to everybody."""
        set_mission_current(self._autopilot, m.seq)
        return []

    def _guide(self, item: Item, *, height_only: bool) -> int:
        """Go to a place now, as DroneKit's simple_goto asks, or change the height only."""
        autopilot = self._autopilot
        result = self._store.check(item._replace(command=_WAYPOINT), MissionType.MISSION)
        if result != ACCEPTED:
            return result
        if autopilot.mode is not Mode.GUIDED or not (height_only or item.has_place):
            return ERROR
        if height_only:
            item = item._replace(x=0, y=0)
        try:
            autopilot.targets.go_to(place_of(autopilot, item))
        except IllegalTarget as reason:
            autopilot.say(f"Target refused: {reason}", mav.MAV_SEVERITY_WARNING, topic="target")
            return ERROR
        autopilot.climb = None
        return ACCEPTED

    # What is so now

    def _sender(self, m: Message) -> Sender:
        return Sender(*_to(m), self)

    def _under_way(self) -> Upload | None:
        """Return the upload under way on any link; one whose link has died is over, too."""
        upload = self._store.upload
        if upload is not None and upload.is_stale(self._autopilot.now):
            self._store.upload = upload = None
        return upload

    def _is_coming_up(self, kind: MissionType) -> bool:
        upload = self._under_way()
        return upload is not None and upload.mission_type is kind

    def _is_flying_it(self) -> bool:
        autopilot, progress = self._autopilot, self._store.progress
        in_auto = autopilot.mode is Mode.AUTO and autopilot.armed
        return in_auto and progress.current is not None and not progress.complete

    def _home_count(self, kind: MissionType) -> int:
        """Return how many items of a list are home: 1 or 0."""
        return self._store.first_seq if kind is MissionType.MISSION else 0

    def _home_item(self) -> Item:
        autopilot = self._autopilot
        home, origin = autopilot.home, autopilot.origin
        lat_deg, lon_deg = origin.to_geodetic(home.north, home.east)
        x, y = round(lat_deg * 1e7), round(lon_deg * 1e7)
        return Item(_WAYPOINT, AMSL, x=x, y=y, z=origin.alt_m - home.down)


def _mission_type(m: Message) -> MissionType | None:
    """Return which list is meant, None for one that we do not have."""
    return next((kind for kind in MissionType if kind == m.mission_type), None)


def _to(m: Message) -> tuple[int, int]:
    return m.get_srcSystem(), m.get_srcComponent()


def _ack(m: Message, result: int) -> Message:
    """Return MISSION_ACK to the sender, about the list that it spoke of."""
    message: Message = mav.MAVLink_mission_ack_message(*_to(m), result, m.mission_type)
    return message
