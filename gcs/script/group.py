"""Several vehicles told the same at once: `fleet.all.arm()`, `fleet["quad1", "quad2"].land()`."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ..team.mission import START_PATIENCE_S
from .vehicle import Vehicle
from .waiting import DEFAULT_S

if TYPE_CHECKING:
    from .fleet import Fleet


class Group:
    """Vehicles that begin together; every call waits until the last of them is done.

    When some fail the others go on; then the first failure is raised, and it tells of the rest.
    """

    def __init__(self, fleet: "Fleet", vehicles: Sequence[Vehicle]) -> None:
        self._fleet = fleet
        self._vehicles = tuple(vehicles)

    def __iter__(self) -> Iterator[Vehicle]:
        return iter(self._vehicles)

    def __len__(self) -> int:
        return len(self._vehicles)

    def arm(self, timeout: float = START_PATIENCE_S) -> None:
        """Take command of all: guided mode, then armed.

        Raises TakenOver when one has disarmed itself on the ground until the last was armed.
        """
        waits = [v.begin_arm(timeout) for v in self]
        self._fleet.await_all(waits)
        self._fleet.await_all(waits)  # all at one moment

    def takeoff(self, up: float, timeout: float = DEFAULT_S) -> None:
        """Have all quadcopters climb to `up` metres; rovers stay where they are."""
        flying = [v for v in self if v.kind == "quadcopter"]
        self._fleet.await_all([v.begin_takeoff(up, timeout) for v in flying])

    def velocity(self, east: float = 0.0, north: float = 0.0, up: float = 0.0) -> None:
        """Have all move at this velocity until told otherwise."""
        for vehicle in self:
            vehicle.velocity(east, north, up)

    def hold(self) -> None:
        """Have all stay where they are."""
        for vehicle in self:
            vehicle.hold()

    def land(self, timeout: float = DEFAULT_S) -> None:
        """Land all (rovers stop) and wait until all are disarmed."""
        self._fleet.await_all([v.begin_land(timeout) for v in self])

    def wait_arrival(self, timeout: float = DEFAULT_S) -> None:
        """Wait until the last order of each is done."""
        self._fleet.await_all([v.arrival(timeout) for v in self])

    def __repr__(self) -> str:
        return f"<group of {', '.join(v.name for v in self)}>"
