"""Scripts that fly a fleet: `from mavherd.gcs import Fleet`. See docs/scripting.md."""

from ...scenarios.schema import Fence
from ...transport.frames import Origin
from .errors import FleetError, LinkLost, Refused, TakenOver, TimedOut
from .fleet import Fleet
from .group import Group
from .values import Event, Moving, Path, Position, State, Velocity
from .vehicle import Vehicle

__all__ = [
    "Event",
    "Fence",
    "Fleet",
    "FleetError",
    "Group",
    "LinkLost",
    "Moving",
    "Origin",
    "Path",
    "Position",
    "Refused",
    "State",
    "TakenOver",
    "TimedOut",
    "Vehicle",
    "Velocity",
]
