"""Where two logs of one vehicle's link part."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from .messages import content, from_ground, header
from .run_folder import Entry

BEFORE = 3
"""So many of the last equal messages are kept, to show what went before."""


class Parting(NamedTuple):
    """The first place where two logs of one link differ; what one of them lacks is None.

    Kinds: `value` (one message, other contents), `missing` (one of them has a message more),
    `order` (the next two are swapped), `time` (the same message at another time), `other` (each
    has a message that the other does not have), `end` (one of them goes on). Where times say
    nothing, as in a free run, no message is called missing: only what comes next is compared.
    """

    kind: str
    a: Entry | None
    b: Entry | None

    @property
    def entry(self) -> Entry:
        """The earlier of the two."""
        entries = [entry for entry in (self.a, self.b) if entry]
        return min(entries, key=lambda entry: entry.time_us)

    @property
    def to_vehicle(self) -> bool:
        """Whether the ground has sent it."""
        return from_ground(self.entry.frame)


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkDifference:
    """What became of one vehicle's link in two runs."""

    vehicle: str
    system_id: int
    messages: tuple[int, int]
    equal: int  # messages before they part
    parting: Parting | None = None  # None: they never do
    before: tuple[Entry, ...] = ()  # the last equal messages

    @property
    def order(self) -> tuple[int, bool, int]:
        """Sort partings by cause: what vehicles say in a tick comes before the ground's answers."""
        if self.parting is None:
            raise ValueError(f"{self.vehicle} does not part")
        return self.parting.entry.time_us, self.parting.to_vehicle, self.system_id


def compare(
    vehicle: str, system_id: int, a: Sequence[Entry], b: Sequence[Entry], *, timed: bool
) -> LinkDifference:
    """Compare message by message, and when each was logged if the runs are `timed`."""
    at = _first_unequal(a, b, timed=timed)
    parting = None
    if at < max(len(a), len(b)):
        parting = _parting(a, b, at, timed=timed)
    return LinkDifference(
        vehicle=vehicle,
        system_id=system_id,
        messages=(len(a), len(b)),
        equal=at,
        parting=parting,
        before=tuple((a if parting.a else b)[max(0, at - BEFORE) : at]) if parting else (),
    )


def _first_unequal(a: Sequence[Entry], b: Sequence[Entry], *, timed: bool) -> int:
    for at, (x, y) in enumerate(zip(a, b, strict=False)):
        if x.frame != y.frame or (timed and x.time_us != y.time_us):
            return at
    return min(len(a), len(b))


def _parting(a: Sequence[Entry], b: Sequence[Entry], at: int, *, timed: bool) -> Parting:
    if at == len(a):
        return Parting("end", None, b[at])
    if at == len(b):
        return Parting("end", a[at], None)
    x, y = a[at], b[at]
    same_time = x.time_us == y.time_us or not timed
    if same_time and content(x.frame) == content(y.frame):
        return Parting("value", x, y)  # its sequence number
    if timed:
        x_comes, y_comes = _find(x, b, at), _find(y, a, at)
        if x_comes and x_comes == y_comes:
            return Parting("order", x, y)
        if x_comes and (not y_comes or x_comes < y_comes):
            return Parting("missing", None, y)
        if y_comes:
            return Parting("missing", x, None)
        if content(x.frame) == content(y.frame):
            return Parting("time", x, y)
        if not same_time:
            earlier = x.time_us < y.time_us
            return Parting("missing", x, None) if earlier else Parting("missing", None, y)
    one_type = header(x.frame).message_id == header(y.frame).message_id
    return Parting("value" if one_type and _one_way(x, y) else "other", x, y)


def _find(entry: Entry, log: Sequence[Entry], at: int) -> int:
    """Return by how many places a message comes later in `log` than at `at`; 0: it does not."""
    wanted = content(entry.frame)
    for distance, other in enumerate(log[at + 1 :], start=1):
        if other.time_us > entry.time_us:
            break
        if other.time_us == entry.time_us and content(other.frame) == wanted:
            return distance
    return 0


def _one_way(x: Entry, y: Entry) -> bool:
    return from_ground(x.frame) == from_ground(y.frame)
