"""The team in the terminal while a run goes on (rich)."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from math import dist, hypot
from time import monotonic

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from ...transport.wire import Phase, VehicleState
from ..mode_names import mode_name
from ..report.contact import contact_distance

REFRESH_HZ = 4
PLAIN_PERIOD_S = 5.0  # of wall time, between lines where there is no terminal
OTHER_LINES = 5  # of the terminal, that are not robots
CLOSE_M = 0.4  # beyond contact; nearer than this is shown in bold
_STYLES = {
    Phase.WAITING: "dim",
    Phase.DONE: "green",
    Phase.DWELL: "green",
}
Near = tuple[float, str]  # m, and to whom


class LiveView:
    """Shows a run while it goes on: a line per robot, or the worst of them and a summary.

    Where `console` is no terminal it writes a plain line every few seconds instead.
    """

    def __init__(
        self, names_kinds: Mapping[str, str], duration: float, console: Console | None = None
    ) -> None:
        self._kinds = dict(names_kinds)
        self._duration = duration
        self._console = console or Console(stderr=True)
        self._live: Live | None = None
        if self._console.is_terminal:
            self._live = Live(console=self._console, auto_refresh=False, transient=True)
        self._next = 0.0

    def __enter__(self) -> "LiveView":
        if self._live:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live:
            self._live.stop()

    def update(
        self,
        now: float,
        states: Sequence[VehicleState],
        targets: Mapping[str, float],
        speed_factor: float,
        message: str = "",
    ) -> None:
        """Show the team at run time `now`; call it as often as you like.

        `targets` is the distance to the target by robot name, m.
        """
        wall = monotonic()
        if wall < self._next:
            return
        self._next = wall + (1 / REFRESH_HZ if self._live else PLAIN_PERIOD_S)
        near = nearest(states)
        if self._live:
            clock = f"{now:.1f} / {self._duration:.0f} s"
            head = Table.grid(padding=(0, 2))
            bar = ProgressBar(self._duration, min(now, self._duration), width=20)
            head.add_row(
                bar,
                clock,
                f"{speed_factor:.1f}x real time",
                Text(message, style="dim", no_wrap=True, overflow="ellipsis"),
            )
            self._live.update(Group(head, *self._team(states, targets, near)), refresh=True)
            return
        parts = [f"{now:6.1f} s", f"{speed_factor:.1f}x", phases(states)]
        if near:
            parts.append(f"nearest {min(near.values())[0]:.2f} m")
        line = "  ".join([*parts, message]).rstrip()
        self._console.print(line, highlight=False, markup=False, soft_wrap=True)

    def _team(
        self, states: Sequence[VehicleState], targets: Mapping[str, float], near: Mapping[str, Near]
    ) -> Iterator[RenderableType]:
        room = max(3, self._console.height - OTHER_LINES)
        shown = self._worst(states, near, room) if len(states) > room else states
        table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False, header_style="dim")
        for head, width in (("robot", 8), ("mode", 9), ("phase", 9)):
            table.add_column(head, no_wrap=True, min_width=width)
        for head, width in (("east", 6), ("north", 6), ("up", 5), ("m/s", 4), ("to go", 6)):
            table.add_column(head, no_wrap=True, min_width=width, justify="right")
        table.add_column("nearest", no_wrap=True, min_width=14)
        for s in shown:
            mode = mode_name(self._kinds[s.name], s.custom_mode)
            table.add_row(
                s.name,
                Text(mode if s.armed else "disarmed", style="" if s.armed else "dim"),
                Text(s.phase.name.lower(), style=_STYLES.get(s.phase, "")),
                *(f"{v:.2f}" for v in s.position),
                f"{hypot(*s.velocity):.2f}",
                _number(targets.get(s.name), 2),
                self._nearest_text(s.name, near),
            )
        yield table
        if len(shown) < len(states):
            rest = len(states) - len(shown)
            yield Text(f"and {rest} more; of all {len(states)}: {phases(states)}", style="dim")

    def _nearest_text(self, name: str, near: Mapping[str, Near]) -> Text:
        if name not in near:
            return Text("-", style="dim")
        distance, other = near[name]
        text = f"{distance:5.2f} {other}"
        return Text(text, style="bold yellow" if self._margin(name, near) < CLOSE_M else "")

    def _margin(self, name: str, near: Mapping[str, Near]) -> float:
        """Return how far a robot is from touching the nearest one."""
        if name not in near:
            return float("inf")
        distance, other = near[name]
        return distance - contact_distance(self._kinds[name], self._kinds[other])

    def _worst(
        self, states: Sequence[VehicleState], near: Mapping[str, Near], count: int
    ) -> list[VehicleState]:
        """Return those who are nearest to another, in the order given."""
        ranked = sorted(states, key=lambda s: self._margin(s.name, near))
        chosen = {s.name for s in ranked[:count]}
        return [s for s in states if s.name in chosen]


def nearest(states: Sequence[VehicleState]) -> dict[str, Near]:
    """Return the distance in space to the nearest other robot, and its name, by robot."""
    best: dict[str, Near] = {}
    for i, a in enumerate(states):
        for b in states[i + 1 :]:
            d = dist(a.position, b.position)
            for me, other in ((a.name, b.name), (b.name, a.name)):
                if me not in best or d < best[me][0]:
                    best[me] = (d, other)
    return best


def phases(states: Sequence[VehicleState]) -> str:
    """Return how many robots are in which phase, in words."""
    counts = Counter(s.phase for s in states)
    return ", ".join(f"{counts[p]} {p.name.lower()}" for p in Phase if counts[p]) or "no state yet"


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
