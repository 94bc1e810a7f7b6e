"""A team as lines of text: a line per robot, or counts by kind and those nearest to trouble.

Plain columns, not a rich table: a table of twenty lines takes 10 ms to lay out, at 4 Hz.
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from math import dist, hypot, inf
from typing import NamedTuple

from rich.text import Text

from ...scenarios.starts import CONTACT_RADIUS
from ...transport.wire import Phase, VehicleState
from ..mode_names import mode_name

CLOSE_M = 0.4  # beyond contact; nearer than this is shown in bold
MAX_ROWS = 24  # of a team that is shown whole
WORST_ROWS = 12  # of one that is not
_FIXED = 2  # lines of a folded team beside robots and kinds
_STYLES = {Phase.WAITING: "dim", Phase.DONE: "green", Phase.DWELL: "green"}
_COLUMNS = {"mode": 9, "phase": 9, "east": 7, "north": 7, "up": 5, "m/s": 4, "to go": 6}  # widths
_LEFT = "mode", "phase"  # where they begin is aligned, not where they end
_FIRST_TO_GO = ("m/s",), ("mode",), ("up",), ("east", "north")  # where there is no room for all
_NO_AGES: Mapping[str, float] = {}
Near = tuple[float, str]  # m, and to whom


class Scene(NamedTuple):
    """What is known of a team at one moment."""

    states: Sequence[VehicleState]
    to_go: Mapping[str, float]  # m to the target, of those who have one
    troubled: Collection[str] = ()  # something was said of them lately that one should look at
    old: Mapping[str, float] = _NO_AGES  # s, of the states that are too old


@dataclass(frozen=True, slots=True)
class TeamText:
    """Writes a team whose robots are of these `kinds`, by name."""

    kinds: Mapping[str, str]

    def lines(self, scene: Scene, room: int, width: int = 80) -> list[Text]:
        """Return no more than `room` lines; columns that `width` has no room for are left out."""
        states = scene.states
        near = nearest(states)
        if len(states) < min(room, MAX_ROWS + 1):
            return self._table(states, scene, near, width)
        summary = self._by_kind(scene, near)
        count = min(WORST_ROWS, room - len(summary) - _FIXED)
        if count < 1:
            return summary[: max(0, room)]
        shown = self._worst(scene, near, count)
        rest = f"and {len(states) - len(shown)} more, farther from trouble"
        return [*summary, *self._table(shown, scene, near, width), Text(rest, style="dim")]

    def _by_kind(self, scene: Scene, near: Mapping[str, Near]) -> list[Text]:
        lines = []
        for kind, total in Counter(self.kinds.values()).items():
            group = [s for s in scene.states if self.kinds[s.name] == kind]
            words = [f"{total:3d} {kind}{'s' * (total > 1)}:"]
            if closest := min((near[s.name] for s in group if s.name in near), default=None):
                words.append(f"nearest {closest[0]:.2f} m  ")
            if far := max((scene.to_go.get(s.name, 0.0) for s in group), default=0.0):
                words.append(f"to go {far:.1f} m  ")
            lines.append(Text(" ".join([*words, phases(group)])))
        return lines

    def _table(
        self, shown: Sequence[VehicleState], scene: Scene, near: Mapping[str, Near], width: int
    ) -> list[Text]:
        wide = max([8, *(len(s.name) for s in shown)])
        columns = _columns(width - 2 * wide - len(" 12.34 "))
        head = [f"{'robot':{wide}}", *(f"{c:{_align(c)}{_COLUMNS[c]}}" for c in columns), "nearest"]
        lines = [Text(" ".join(head), style="dim")]
        for s in shown:
            is_bad = s.name in scene.troubled or s.name in scene.old
            line = Text(f"{s.name:{wide}}", style="")
            line.stylize("bold red" if is_bad else "")
            for column in columns:
                text, style = self._cell(column, s, scene)
                line.append(f" {text:{_align(column)}{_COLUMNS[column]}}", style)
            if s.name in near:
                distance, other = near[s.name]
                close = self._margin(s.name, near) < CLOSE_M
                line.append(f" {distance:5.2f} {other}", "bold yellow" if close else None)
            else:
                line.append(" -", "dim")
            lines.append(line)
        return lines

    def _cell(self, column: str, s: VehicleState, scene: Scene) -> tuple[str, str | None]:
        """Return what a robot has in a column, and how it looks."""
        match column:
            case "mode":
                mode = mode_name(self.kinds[s.name], s.custom_mode)
                return (mode if s.armed else "disarmed")[:9], None if s.armed else "dim"
            case "phase":
                if (age := scene.old.get(s.name)) is not None:
                    return f"{min(age, 9999):.0f} s old", "bold yellow"
                return s.phase.name.lower(), _STYLES.get(s.phase)
            case "m/s":
                return f"{hypot(*s.velocity):.2f}", None
            case "to go":
                to_go = scene.to_go.get(s.name)
                return "-" if to_go is None else f"{to_go:.2f}", None
            case axis:
                return f"{s.position[('east', 'north', 'up').index(axis)]:.2f}", None

    def _margin(self, name: str, near: Mapping[str, Near]) -> float:
        """Return how far a robot is from touching the nearest one."""
        if name not in near:
            return float("inf")
        distance, other = near[name]
        return distance - CONTACT_RADIUS[self.kinds[name]] - CONTACT_RADIUS[self.kinds[other]]

    def _worst(self, scene: Scene, near: Mapping[str, Near], count: int) -> list[VehicleState]:
        """Return those in trouble, then those who are nearest to another, in the order given."""

        def rank(s: VehicleState) -> tuple[bool, float]:
            fine = s.name not in scene.troubled and s.name not in scene.old
            return fine, self._margin(s.name, near)

        chosen = {s.name for s in sorted(scene.states, key=rank)[:count]}
        return [s for s in scene.states if s.name in chosen]


def nearest(states: Sequence[VehicleState]) -> dict[str, Near]:
    """Return the distance in space to the nearest other robot, and its name, by robot."""
    axis = max((0, 1), key=lambda k: _spread([s.position[k] for s in states]))
    line = sorted((s.position[axis], s.position, s.name) for s in states)
    found: dict[str, Near] = {}
    for i, (at, place, name) in enumerate(line):
        best, whose = inf, ""
        for others in (islice(line, i + 1, None), reversed(line[:i])):
            for other_at, other, other_name in others:
                if abs(other_at - at) > best:  # and so are all that follow
                    break
                if (apart := dist(place, other)) < best:
                    best, whose = apart, other_name
        if whose:
            found[name] = best, whose
    return found


def _columns(room: int) -> list[str]:
    """Return the columns that there is room for."""
    columns = list(_COLUMNS)
    for group in _FIRST_TO_GO:
        if sum(_COLUMNS[column] + 1 for column in columns) <= room:
            break
        columns = [column for column in columns if column not in group]
    return columns


def _align(column: str) -> str:
    return "<" if column in _LEFT else ">"


def _spread(values: Sequence[float]) -> float:
    return max(values, default=0.0) - min(values, default=0.0)


def phases(states: Sequence[VehicleState]) -> str:
    """Return how many robots are in which phase, in words."""
    counts = Counter(s.phase for s in states)
    return ", ".join(f"{counts[p]} {p.name.lower()}" for p in Phase if counts[p]) or "no state yet"
