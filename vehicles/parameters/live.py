"""Parameters that the vehicle itself writes: how long its lists are, how long it has run."""

from typing import TYPE_CHECKING

from ..missions.store import MissionStore
from .store import Parameters

if TYPE_CHECKING:
    from ..vehicle import Vehicle


def show_lists(parameters: Parameters, missions: MissionStore) -> None:
    """Have MIS_TOTAL (home included), FENCE_TOTAL and RALLY_TOTAL tell the lists' lengths."""

    def mission_total() -> int:
        items = len(missions.mission)
        return items + missions.first_seq if items else 0

    parameters.follow("MIS_TOTAL", mission_total)
    parameters.follow("FENCE_TOTAL", lambda: len(missions.fence))
    parameters.follow("RALLY_TOTAL", lambda: len(missions.rally))


def show_statistics(parameters: Parameters, vehicle: "Vehicle") -> None:
    """Have STAT_BOOTCNT and STAT_RUNTIME (s, of all boots) tell the vehicle's own."""
    parameters.follow("STAT_BOOTCNT", lambda: vehicle.boots + 1)
    parameters.follow("STAT_RUNTIME", lambda: vehicle.now_us // 1_000_000)
