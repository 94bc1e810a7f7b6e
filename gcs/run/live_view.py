"""The team in the terminal while a run goes on (rich)."""

from collections.abc import Mapping
from time import monotonic

from rich.console import Console, RenderableType
from rich.text import Text

from .screen import Screen
from .team_text import Scene, TeamText, nearest, phases
from .view import Going

PLAIN_PERIOD_S = 5.0  # of wall time, between lines where there is no terminal
FIRST_LINE_S = 2.0  # what is over by then needs none
_BAR = 20  # columns
_LEAST_BAR = 8
_SLOWEST = 0.01  # times real time; below, nobody knows when it ends


class LiveView:
    """Shows a run while it goes on; `hint` is its last line: what keys do, say.

    Where `console` is no terminal it writes a plain line every few seconds instead. `step` is a
    tick, s: times are shown so finely that each can be seen.
    """

    def __init__(
        self,
        kinds: Mapping[str, str],
        duration: float,
        console: Console,
        hint: str = "",
        step: float = 0.05,
    ) -> None:
        self._text = TeamText(dict(kinds))
        self._duration = duration
        self._console = console
        self._hint = hint
        self._screen = Screen(console) if console.is_interactive else None
        self._digits = next((n for n in (1, 2, 3) if abs(step - round(step, n)) < 1e-9), 3)
        self._next = 0.0
        self._told = ""  # in plain lines

    def clear(self) -> None:
        """Take the view away; what was printed stays."""
        if self._screen:
            self._screen.clear()

    def print(self, what: RenderableType) -> None:
        """Print something that stays, above the view."""
        write = self._screen.print if self._screen else self._console.print
        write(what, highlight=False, markup=False, soft_wrap=isinstance(what, str))

    def update(self, now: float, scene: Scene, going: Going, message: str = "") -> None:
        """Show the team at run time `now`.

        A terminal is drawn each time; plain lines come no oftener for that. `message` is what
        happened last.
        """
        if self._screen:
            self._screen.draw(self._frame(now, scene, going, message))
            return
        wall = monotonic()
        self._next = self._next or wall + FIRST_LINE_S
        if wall < self._next:
            return
        self._next = wall + PLAIN_PERIOD_S
        words = [f"{now:6.{self._digits}f} s", f"{going.factor:.1f}x", going.clock]
        words.append(phases(scene.states))
        if near := nearest(scene.states):
            words.append(f"nearest {min(near.values())[0]:.2f} m")
        words += [self._left(now, going), *_signs(scene, going)]
        words.append(message if message != self._told else "")
        self._told = message
        self.print("  ".join(filter(None, words)))

    def _frame(self, now: float, scene: Scene, going: Going, message: str) -> list[Text]:
        size = self._console.size
        lines = [self._head(now, going, size.width), Text(message or "-", style="dim")]
        if signs := _signs(scene, going):
            lines.append(Text(", ".join(signs), style="yellow"))
        last = [Text(self._hint, style="dim")] if self._hint else []
        room = size.height - 1 - len(lines) - len(last)  # the cursor's line is the last
        return [*lines, *self._text.lines(scene, room, size.width), *last]

    def _head(self, now: float, going: Going, width: int) -> Text:
        """Return how far it is: as much of it as there is room for."""
        clock = Text(f"   {going.clock}" if going.clock else "", style="bold yellow")
        head = Text(f"{now:.{self._digits}f} / {self._duration:g} s")
        left = self._left(now, going)
        for more in (f"   {going.factor:.1f}x real time", f"   {left}" if left else ""):
            if head.cell_len + len(more) + clock.cell_len <= width:
                head.append(more)
        head.append_text(clock)
        room = min(_BAR, width - head.cell_len - 2)
        if room < _LEAST_BAR:
            return head
        full = round(room * min(1.0, now / self._duration))
        line = "-" if self._console.options.ascii_only else "━"
        done = "=" if line == "-" else line
        bar = Text.assemble((done * full, "blue"), (line * (room - full), "bright_black"))
        if self._console.no_color and line != "-":  # then only its shape tells
            bar = Text("━" * full + "╌" * (room - full))
        return Text.assemble(bar, "  ", head)

    def _left(self, now: float, going: Going) -> str:
        """Return how long it can still take, empty when nobody knows."""
        if going.clock == "paused" or going.factor < _SLOWEST or now >= self._duration:
            return ""
        return f"at most {span((self._duration - now) / going.factor)} left"


def span(seconds: float) -> str:
    """Return a time in words as long as it needs: `54 s`, `3:20 min`, `2:05 h`."""
    if (whole := round(seconds)) < 60:
        return f"{whole} s"
    minutes, s = divmod(whole, 60)
    hours, m = divmod(minutes, 60)
    return f"{hours}:{m:02d} h" if hours else f"{minutes}:{s:02d} min"


def _signs(scene: Scene, going: Going) -> list[str]:
    """Return what one should know that is as it should not be, or might not expect."""
    signs = []
    if going.late:
        signs.append(f"{going.late} tick{'s' * (going.late > 1)} late")
    if going.outside:
        signs.append(f"{going.outside} outside client{'s' * (going.outside > 1)}")
    if old := sorted(scene.old, key=lambda name: -scene.old[name]):
        more = f" and {len(old) - 1} more" if len(old) > 1 else ""
        signs.append(f"no news of {old[0]}{more} for {scene.old[old[0]]:.0f} s")
    return signs
