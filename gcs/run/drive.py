"""How time passes in the launcher: granted tick by tick as asked for, or by the wall clock."""

import time
from collections.abc import Callable
from contextlib import nullcontext
from math import ceil
from typing import TYPE_CHECKING

from .clock_control import ClockControl
from .clock_desk import SLICE_S, ClockDesk
from .conductor import FreeRun, Interrupted, Lockstep
from .keys import Keys
from .open_run import OpenRun
from .showing import Showing
from .view import Going

if TYPE_CHECKING:
    from .in_process_run import InProcessRun
    from .in_process_team import InProcess

_LISTEN_S = 0.1


def drive(
    run: "OpenRun | InProcessRun",
    clock: "Lockstep | InProcess",
    showing: Showing,
    interrupted: Callable[[], bool],
    keys: Keys | None = None,
) -> None:
    """Grant tick after tick until the run is over; raise Interrupted when the user has enough.

    Time that stands still is no part of the run's wall time.
    """
    period, duration = 1.0 / run.scenario.team.rate_hz, run.scenario.duration
    period_us = run.scenario.team.period_us
    begun = look_at = time.monotonic()
    control = ClockControl(period, run.options.speed, paused=run.options.paused, wall=begun)
    desk = ClockDesk(run.bus, control, run.note, keys)
    try:
        with keys or nullcontext():
            while not clock.finished and not clock.expired(duration):
                if interrupted():
                    raise Interrupted
                wall = time.monotonic()
                if wall >= look_at or wall < control.due:
                    look_at = wall + SLICE_S
                    changed = desk.attend(clock.now)
                    if isinstance(run, OpenRun):
                        run.look_after_recording()
                    outside = clock.outside if isinstance(clock, Lockstep) else 0
                    showing.show_paced(control, at_once=changed, outside=outside)
                    if control.due > wall:
                        desk.wait(control.due)
                        continue
                most = 1 if desk.is_followed else control.allowed(wall)
                # not one more than until the run expires (no external vehicles here: from 0)
                left = ceil((duration - clock.now) / period - 1e-6)
                ticks = _advance(clock, period_us, max(1, min(most, left)))
                desk.tick(clock.now)
                control.ticked(clock.now, time.monotonic(), ticks)
    finally:
        wall = time.monotonic()
        run.wall_s = wall - begun - control.stood(wall)
        clock.late = control.late
        desk.close()


def listen(run: OpenRun, clock: FreeRun, showing: Showing, interrupted: Callable[[], bool]) -> None:
    """Follow a team that runs free until its run is over; raise Interrupted when it shall end."""
    desk = ClockDesk(run.bus, None, run.note)
    try:
        while not clock.finished and not clock.expired(run.scenario.duration):
            if interrupted():
                raise Interrupted
            clock.listen(run.started, _LISTEN_S)
            desk.attend(clock.now)
            run.look_after_recording()
            late = sum(coordinator.late for coordinator in clock.coordinators)
            showing.show(clock.now, Going(late=late))
    finally:
        run.wall_s = time.monotonic() - run.started
        desk.close()


def _advance(clock: "Lockstep | InProcess", period_us: int, most: int) -> int:
    """Advance by one tick or, where it goes by itself for a moment, several; return by how many."""
    if isinstance(clock, Lockstep):
        return clock.advance(period_us, most)
    clock.tick(period_us)
    return 1
