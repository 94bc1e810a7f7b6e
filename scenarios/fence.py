"""The fence of a scenario, and everything that must lie inside it."""

from collections.abc import Iterable

from ..transport.frames import Triple
from .paths import extremes
from .reader import Fields
from .robots import MIN_UP, PATHS
from .schema import Fence, RobotSpec, Team

_KEYS = ("east", "north", "up")


def read_fence(root: Fields) -> Fence | None:
    """Return the scenario's fence, None when it has none."""
    if root.raw("fence") is None:
        return None
    fields = root.mapping("fence", _KEYS)
    return Fence(
        east=fields.interval("east"),
        north=fields.interval("north"),
        up=fields.number("up", low=MIN_UP),
    )


def check_fence(fence: Fence, read: Iterable[tuple[RobotSpec, Fields]], team: Team) -> None:
    """Refuse robots that stand, or are sent, where the fence would not let them be."""
    for spec, fields in read:
        start = (spec.start.east, spec.start.north, 0.0)
        if not fence.holds(start):
            raise fields.error("start", *_outside(spec, "starts", start, fence))
        for place in extremes(spec.path, spec, team):
            if not fence.holds(place):
                key = next((key for key in PATHS if key in fields), "start")
                raise fields.error(key, *_outside(spec, "is sent", place, fence))


def _outside(spec: RobotSpec, does: str, place: Triple, fence: Fence) -> tuple[str, str]:
    """Return problem and cure."""
    east, north, up = place
    box = f"east {fence.east[0]:g} to {fence.east[1]:g}, north {fence.north[0]:g} to"
    return (
        f"{spec.name!r} {does} outside the fence, at east {east:g}, north {north:g}, up {up:g}",
        f"fence: {box} {fence.north[1]:g}, up to {fence.up:g} m",
    )
