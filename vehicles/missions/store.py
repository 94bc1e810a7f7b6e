"""The three lists of one vehicle, and how far its mission has got."""

from collections.abc import Sequence

from .checks import ACCEPTED, REASONS, check, check_list
from .items import Item, MissionType
from .plan import MissionError, Plan
from .progress import Progress
from .upload import Upload

LIMITS = {MissionType.MISSION: 723, MissionType.FENCE: 250, MissionType.RALLY: 100}
"""Items that each list holds, home not counted."""


class ItemList:
    """One list. `revision` grows with each change, so that a reader sees that it was replaced."""

    def __init__(self, mission_type: MissionType) -> None:
        self.mission_type = mission_type
        self.limit = LIMITS[mission_type]
        self.items: tuple[Item, ...] = ()
        self.revision = 0

    def replace(self, items: Sequence[Item]) -> None:
        """Take a whole new list; the items have been checked."""
        if len(items) > self.limit:
            raise ValueError(f"at most {self.limit} items, got {len(items)}")
        self.items = tuple(items)
        self.revision += 1

    def __len__(self) -> int:
        return len(self.items)


class MissionStore:
    """Mission, fence and rally list of one vehicle, and the progress of its mission.

    The mission holds no home. `first_seq` is the number by which the ground knows its first
    item: 1 where clients expect home as item 0 (ArduPilot), else 0.
    """

    def __init__(self, kind: str, *, home_is_item_0: bool = True) -> None:
        self.kind = kind
        self.first_seq = 1 if home_is_item_0 else 0
        self.lists = {kind: ItemList(kind) for kind in MissionType}
        self.progress = Progress(self.first_seq)
        self.upload: Upload | None = None  # the one under way, over all links

    @property
    def mission(self) -> ItemList:
        """Return what AUTO flies."""
        return self.lists[MissionType.MISSION]

    @property
    def fence(self) -> ItemList:
        """Return the fence's polygons, circles and return point."""
        return self.lists[MissionType.FENCE]

    @property
    def rally(self) -> ItemList:
        """Return the rally points."""
        return self.lists[MissionType.RALLY]

    def check(self, item: Item, mission_type: int) -> int:
        """Return MAV_MISSION_ACCEPTED, or why this vehicle refuses `item` in that list."""
        return check(item, self.kind, mission_type)

    def replace(self, mission_type: MissionType, items: Sequence[Item]) -> None:
        """Take a whole new list."""
        self.lists[mission_type].replace(items)

    def set_current(self, seq: int, *, reset: bool = False) -> bool:
        """Go on with the item that the ground calls `seq`; False when there is none such.

        Home stands for the beginning. `reset` forgets how often jumps were taken.
        """
        index = max(0, seq - self.first_seq)
        if not 0 <= seq < len(self.mission) + self.first_seq or not len(self.mission):
            return False
        if reset:
            self.progress.begin_again()
        self.progress.go_to(index)
        return True

    def rest(self) -> None:
        """Forget what was under way, upload and flight: the vehicle boots again."""
        self.upload = None
        self.progress.begin_again()
        self.progress.started = False

    def load(self, plan: Plan, where: str = "plan") -> None:
        """Take the three lists of a plan, read from `where`; raise MissionError for what we refuse.

        Nothing is taken then.
        """
        lists = {
            MissionType.MISSION: plan.numbered_from(self.first_seq),
            MissionType.FENCE: plan.fence,
            MissionType.RALLY: plan.rally,
        }
        for kind, items in lists.items():
            self._demand(items, kind, f"{where}: {kind.name.lower()}")
        for kind, items in lists.items():
            self.replace(kind, items)
        self.progress.begin_again()

    def _demand(self, items: Sequence[Item], mission_type: MissionType, where: str) -> None:
        limit = self.lists[mission_type].limit
        if len(items) > limit:
            raise MissionError(where, f"{len(items)} items are too many", f"at most {limit}")
        for number, item in enumerate(items, start=1):
            if (result := self.check(item, mission_type)) != ACCEPTED:
                problem = f"command {item.command} is refused by a {self.kind}"
                raise MissionError(f"{where} item {number}", problem, REASONS[result])
        if problem_of_list := check_list(items, mission_type):
            raise MissionError(where, problem_of_list)
