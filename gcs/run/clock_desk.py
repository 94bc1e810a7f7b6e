"""Where a run's clock takes orders between ticks: keys of the terminal, and questions on the bus.

clock           simulated seconds as text, each tick while somebody listens
clock/state     how it stands, as JSON: when that changes, and once a second
clock/command   asked, with a command; answered with the state, or refused with the reason
"""

import json
import time
from collections.abc import Callable
from typing import Any

from ...scenarios.errors import show
from ...transport.bus import Bus
from ...transport.errors import MavherdError
from ...transport.local_bus import LocalBus
from ...transport.questions import Question
from .clock_control import FREE, ClockControl
from .conductor import Interrupted
from .keys import COMMANDS, QUIT, Keys

SLICE_S = 0.05  # how often somebody may have asked for something, or pressed Ctrl-C
OVER = "the run is over"
_REPEAT_S = 1.0
Note = Callable[[dict[str, Any]], None]
"""Takes an event."""


class ClockDesk:
    """Hears orders for `control`; None is a clock that takes none, free-running.

    Every order that has changed something and every refusal becomes an event for `note`.
    """

    def __init__(
        self,
        bus: Bus | LocalBus,
        control: ClockControl | None,
        note: Note,
        keys: Keys | None = None,
    ) -> None:
        self._control = control
        self._note = note
        self._keys = keys
        self._questions = bus.questions("clock/command")
        self._ticks = bus.publisher("clock")
        self._state = bus.publisher("clock/state")
        self._told: tuple[bool, float | None] | None = None
        self._repeat_at = 0.0
        self._stepping: list[Question] = []  # answered when the steps are done

    @property
    def is_followed(self) -> bool:
        """Whether somebody wants to know of each tick."""
        return self._ticks.wanted

    def tick(self, now: float) -> None:
        """Say that a tick, or several, have led to fleet time `now`."""
        self._ticks.put(f"{now:.6f}".encode())

    def attend(self, now: float) -> bool:
        """Take every order that waits; return whether one has changed anything.

        `now` is fleet time. Raises Interrupted when the user wants the run to end.
        """
        changed = False
        for key in self._keys.pressed() if self._keys else ():
            if key == QUIT:
                raise Interrupted
            if command := COMMANDS.get(key):
                changed |= self._obey(command, now)
        for question in self._questions.drain():
            changed |= self._hear(question, now)
        if self._control:
            if not self._control.stepping:
                self._answer_steps(self._control)
            self._tell(self._control)
        return changed

    def close(self) -> None:
        """Take no more orders: answer who waits for steps, refuse what was not heard in time."""
        if self._control:
            self._answer_steps(self._control)
        for question in self._questions.drain():
            question.refuse(OVER)

    def wait(self, until: float) -> None:
        """Wait for a moment on the monotonic clock, or for a key; not for long."""
        seconds = min(SLICE_S, until - time.monotonic())
        if seconds > 0 and self._keys:
            self._keys.wait(seconds)
        elif seconds > 0:
            time.sleep(seconds)

    def _hear(self, question: Question, now: float) -> bool:
        command = " ".join(question.text.lower().split())
        try:
            changed = self._obey(command, now)
        except MavherdError as refusal:
            self._event(now, f"refused: {refusal}")
            question.refuse(str(refusal))
            return False
        if self._control and self._control.stepping and command.startswith("step"):
            self._stepping.append(question)
        elif self._control:
            question.answer(json.dumps(self._control.status()))
        return changed

    def _obey(self, command: str, now: float) -> bool:
        if self._control is None:
            raise MavherdError(FREE)
        was_stepping = self._control.stepping
        changed = self._control.order(command, time.monotonic())
        if was_stepping and not self._control.stepping:
            self._call_off_steps(f"called off by {show(command)} at {now:.2f} s")
        if changed:
            toggled = "pause" if self._control.paused else "resume"
            self._event(now, toggled if command == "toggle" else command)
        return changed

    def _event(self, now: float, text: str) -> None:
        self._note({"t": round(now, 6), "vehicle": None, "kind": "clock", "text": text})

    def _call_off_steps(self, reason: str) -> None:
        for question in self._stepping:
            question.refuse(f"{' '.join(question.text.split())}: {reason}")
        self._stepping = []

    def _answer_steps(self, control: ClockControl) -> None:
        for question in self._stepping:
            question.answer(json.dumps(control.status()))
        self._stepping = []

    def _tell(self, control: ClockControl) -> None:
        """Publish how the clock stands: a change at once, else for those who have come since."""
        status, wall = control.status(), time.monotonic()
        settings = control.paused, control.speed
        if settings != self._told or wall >= self._repeat_at:
            self._told, self._repeat_at = settings, wall + _REPEAT_S
            self._state.put(json.dumps(status).encode())
