"""Two runs side by side: what was different from the start, and where they part."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from .links import LinkDifference, compare
from .run_folder import FlownRun
from .wholeness import damage


class Setting(NamedTuple):
    """A key of the scenario that two runs give differently; None: one of them does not."""

    key: str
    a: Any
    b: Any


@dataclass(frozen=True, slots=True, kw_only=True)
class RunDifference:
    """What two runs differ in. `links` are those of the vehicles that both have, by system id."""

    a: FlownRun
    b: FlownRun
    settings: tuple[Setting, ...]
    only_in_a: tuple[str, ...]  # vehicles
    only_in_b: tuple[str, ...]
    links: tuple[LinkDifference, ...]
    damage_a: tuple[str, ...] = ()  # what is wrong with its logs
    damage_b: tuple[str, ...] = ()

    @property
    def equal(self) -> bool:
        """Whether both runs have the same bytes on the same links, and all that was logged."""
        damaged = self.damage_a or self.damage_b
        return not (self.only_in_a or self.only_in_b or self.partings or damaged)

    @property
    def partings(self) -> list[LinkDifference]:
        """The links that part, the first one first."""
        parted = (link for link in self.links if link.parting)
        return sorted(parted, key=lambda link: link.order)


def difference(a: FlownRun, b: FlownRun) -> RunDifference:
    """Compare two runs. Raises MavherdError when a log cannot be read."""
    timed = a.lockstep and b.lockstep
    only_in_a = tuple(name for name in a.vehicles if name not in b.vehicles)
    only_in_b = tuple(name for name in b.vehicles if name not in a.vehicles)
    return RunDifference(
        a=a,
        b=b,
        settings=tuple(_settings(a.settings, b.settings, {*only_in_a, *only_in_b})),
        only_in_a=only_in_a,
        only_in_b=only_in_b,
        links=tuple(
            compare(name, system_id, a.entries(name), b.entries(name), timed=timed)
            for name, system_id in a.vehicles.items()
            if name in b.vehicles
        ),
        damage_a=tuple(damage(a)),
        damage_b=tuple(damage(b)),
    )


def _settings(
    a: Mapping[str, Any], b: Mapping[str, Any], absent: Collection[str]
) -> Iterator[Setting]:
    """Yield what differs; of a vehicle that one of them does not have, that says enough."""
    for key in dict.fromkeys([*a, *b]):
        first, _, rest = key.partition(".")
        gone = first == "robots" and rest.partition(".")[0] in absent
        if a.get(key) != b.get(key) and not gone:
            yield Setting(key, a.get(key), b.get(key))
