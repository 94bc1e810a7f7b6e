"""What failsafes and a breached fence make a vehicle do."""

from typing import TYPE_CHECKING

from .modes import Mode
from .settings import Action
from .wording import Disarming

if TYPE_CHECKING:
    from .autopilot import Autopilot

_MODES: dict[str, dict[Action, tuple[Mode, ...]]] = {  # the first one that can be entered
    "quadcopter": {
        Action.HOLD: (Mode.HOLD, Mode.LAND),
        Action.RTL: (Mode.RTL, Mode.LAND),
        Action.LAND: (Mode.LAND,),
    },
    "rover": {
        Action.HOLD: (Mode.HOLD,),
        Action.RTL: (Mode.RTL, Mode.HOLD),
        Action.LAND: (Mode.HOLD,),
    },
}
QUIET = (Action.NONE, Action.WARN)
"""Actions that leave the vehicle to what it does."""


def would_disarm(autopilot: "Autopilot", action: Action) -> bool:
    """Return whether `action` disarms now: a copter that stands need not go anywhere."""
    stands = autopilot.flies and not autopilot.in_air
    return action is Action.DISARM or (action not in QUIET and stands)


def react(autopilot: "Autopilot", action: Action) -> None:
    """Do what `action` says to an armed vehicle. A mode that it is in already goes on."""
    if would_disarm(autopilot, action):
        autopilot.arming.disarm(force=True, because=Disarming.FAILSAFE)
    elif action not in QUIET:
        modes = _MODES[autopilot.config.kind][action]
        autopilot.change_mode(next(m for m in modes if m in autopilot.modes.rows))
