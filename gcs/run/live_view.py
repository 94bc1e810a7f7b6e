"""The team in the terminal while a run goes on (rich)."""

from collections.abc import Mapping
from time import monotonic

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from .team_text import Scene, TeamText, nearest, phases

PLAIN_PERIOD_S = 5.0  # of wall time, between lines where there is no terminal
_OTHER_LINES = 3  # of the terminal, that are not the team's: two heads, and the one below all


class LiveView:
    """Shows a run while it goes on; `hint` is its last line: what keys do, say.

    Where `console` is no terminal it writes a plain line every few seconds instead.
    """

    def __init__(
        self,
        kinds: Mapping[str, str],
        duration: float,
        console: Console | None = None,
        hint: str = "",
    ) -> None:
        self._text = TeamText(dict(kinds))
        self._duration = duration
        self._console = console or Console(stderr=True)
        self._hint = hint
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
        self, now: float, scene: Scene, factor: float, message: str = "", clock: str = ""
    ) -> None:
        """Show the team at run time `now`, `factor` times real time.

        A terminal is drawn each time; plain lines come no oftener for that. `message` is what
        happened last, `clock` what was asked of the clock.
        """
        if self._live:
            head = _line(f"{now:.1f} / {self._duration:.0f} s   {factor:.1f}x real time   ")
            head.append(clock, "bold yellow")
            bar = Table.grid(padding=(0, 2))
            bar.add_row(ProgressBar(self._duration, min(now, self._duration), width=20), head)
            room = self._console.height - _OTHER_LINES - bool(self._hint)
            team = self._text.lines(scene, room)
            team.no_wrap, team.overflow = True, "crop"
            parts: list[RenderableType] = [bar, _line(message or "-", "dim"), team]
            if self._hint:
                parts.append(_line(self._hint, "dim"))
            self._live.update(Group(*parts), refresh=True)
            return
        wall = monotonic()
        if wall < self._next:
            return
        self._next = wall + PLAIN_PERIOD_S
        words = [f"{now:6.1f} s", f"{factor:.1f}x", *filter(None, [clock]), phases(scene.states)]
        if near := nearest(scene.states):
            words.append(f"nearest {min(near.values())[0]:.2f} m")
        line = "  ".join([*words, message]).rstrip()
        self._console.print(line, highlight=False, markup=False, soft_wrap=True)


def _line(text: str, style: str = "") -> Text:
    return Text(text, style=style, no_wrap=True, overflow="ellipsis")
