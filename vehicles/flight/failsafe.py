"""Failsafes: what happens when the ground, the sticks, the setpoints or the charge are lost.

Each loss counts once: something is said, the user's action is taken, and nothing more until it
is over. The mode of before does not come back by itself, and whoever changes the mode afterwards
is obeyed. ArduPilot's loss of velocity targets is none of these: they expire (`targets.py`).
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from .battery import Level
from .modes import Mode
from .reaction import react, would_disarm
from .settings import Action, Settings
from .wording import Event, Line, Loss, wording

if TYPE_CHECKING:
    from .autopilot import Autopilot

_INTERVAL = 0.1  # s between two looks
_SOON = 1e-6  # s
_BATTERY = {Loss.BATTERY_LOW, Loss.BATTERY_CRITICAL}
_DELAYED = (Action.RTL, Action.LAND)  # may begin with a hold


class _Later(NamedTuple):
    """What follows a hold."""

    loss: Loss
    action: Action
    at: float


class _Station:
    """When the ground station that counts was heard last."""

    def __init__(self, settings: Settings, *, any_will_do: bool) -> None:
        self._settings = settings
        self._any_will_do = any_will_do
        self._system_id: int | None = None  # never heard
        self._heard_at = 0.0

    def heard(self, system_id: int, now: float) -> None:
        """Note a HEARTBEAT; only SYSID_MYGCS counts, unless any will do."""
        if self._any_will_do or system_id == self._settings.gcs_system_id:
            self._system_id, self._heard_at = system_id, now

    def is_lost(self, now: float) -> bool:
        """Return whether a station that was heard is silent now."""
        if self._system_id is None or not self._settings.gcs_failsafe:
            return False
        if self._system_id != self._settings.gcs_system_id and not self._any_will_do:
            return False  # SYSID_MYGCS has changed since
        return now - self._heard_at > self._settings.gcs_timeout


class Failsafes:
    """Watches for losses. `update` is called every 10 ms and works every 100 ms."""

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._words = wording(autopilot.personality.name, autopilot.config.kind)
        self._due = 0.0
        self._station = _Station(autopilot.settings, any_will_do=self._words.any_station)
        self._lost: set[Loss] = set()
        self._acting: set[Loss] = set()  # those of them that were acted on
        self._later: _Later | None = None

    @property
    def active(self) -> bool:
        """Whether something is lost and has been acted on."""
        return bool(self._acting)

    def heard_station(self, system_id: int, now: float) -> None:
        """Note a HEARTBEAT of a ground station; only SYSID_MYGCS counts on ArduPilot."""
        self._station.heard(system_id, now)

    def refusal(self) -> str | None:
        """Return why losses that failsafes would act on at once forbid arming."""
        words = self._words.arming
        for loss, text in ((Loss.STATION, words.station_lost), (Loss.PILOT, words.pilot_lost)):
            action = _ACTIONS[loss](self._autopilot.settings)
            if action is not Action.NONE and _is_lost(loss, self._autopilot, self._station):
                return text
        return None

    def update(self) -> None:
        """Look for losses, and for their end."""
        autopilot = self._autopilot
        if autopilot.now < self._due:
            return
        self._due = autopilot.now + _INTERVAL - _SOON
        autopilot.fence.update()
        for loss, event in self._words.events.items():
            if _is_lost(loss, autopilot, self._station):
                if loss not in self._lost:
                    self._begin(loss, event)
            elif loss in self._lost:
                self._end(loss, event)
        if not autopilot.armed:
            self._acting.clear()
            self._later = None
            self._lost = {x for x in self._lost if self._words.events[x].while_disarmed}
        elif self._later is not None:
            self._follow_up(self._later)

    def _begin(self, loss: Loss, event: Event) -> None:
        """Say that something is lost, and act."""
        autopilot = self._autopilot
        action = _ACTIONS[loss](autopilot.settings)
        if not autopilot.armed:
            if event.while_disarmed:
                self._lost.add(loss)
                self._say(event.noticed)
            return
        if self._is_quiet(event) or (action is Action.NONE and event.noticed is None):
            return
        self._lost.add(loss)
        self._say(event.noticed)
        if action is not Action.NONE:
            self._acting.add(loss)
            self._act(loss, event, action)

    def _act(self, loss: Loss, event: Event, action: Action) -> None:
        if action is Action.WARN:
            self._say(event.acted if event.warns else None)
        elif would_disarm(self._autopilot, action):
            self._say(event.acted, " - Disarming")
            react(self._autopilot, action)
        elif reason := self._exemption(loss, event):
            self._say(event.acted, f" - {reason}")
        else:
            self._say(event.acted)
            if event.hold_first and action in _DELAYED:
                at = self._autopilot.now + event.hold_first
                self._later = _Later(loss, action, at)
                action = Action.HOLD
            react(self._autopilot, action)

    def _end(self, loss: Loss, event: Event) -> None:
        """Say that what was lost is back; the mode stays."""
        self._lost.discard(loss)
        self._acting.discard(loss)
        self._say(event.cleared)
        if self._later is not None and self._later.loss is loss:
            self._later = None

    def _follow_up(self, later: _Later) -> None:
        """Go on after a hold, unless somebody has taken over."""
        if self._autopilot.mode is not Mode.HOLD:
            self._later = None
        elif self._autopilot.now >= later.at:
            self._later = None
            react(self._autopilot, later.action)

    def _exemption(self, loss: Loss, event: Event) -> str | None:
        """Return why the vehicle goes on with what it does, None if it does not."""
        mode, options = self._autopilot.mode, self._autopilot.settings.failsafe_options
        if mode is Mode.LAND and (self._acting - {loss}) & _BATTERY:
            return "Continuing Landing"  # there is no charge for anything else
        exemptions = event.exemptions
        return next((x.text for x in exemptions if options & x.bit and mode in x.modes), None)

    def _is_quiet(self, event: Event) -> bool:
        mode = self._autopilot.mode
        option = self._autopilot.settings.failsafe_options & event.hold_option
        return mode in event.quiet_in and not (option and mode is Mode.HOLD)

    def _say(self, line: Line | None, suffix: str = "") -> None:
        if line is not None:
            battery = self._autopilot.battery
            text = line.text.format(voltage=battery.voltage, used=battery.consumed_mah)
            self._autopilot.say(text + suffix, line.severity)


_ACTIONS: dict[Loss, Callable[[Settings], Action]] = {
    Loss.STATION: lambda s: s.gcs_action,
    Loss.PILOT: lambda s: s.pilot_loss_action,
    Loss.SETPOINTS: lambda s: s.offboard_loss_action,
    Loss.BATTERY_LOW: lambda s: s.battery.low_action,
    Loss.BATTERY_CRITICAL: lambda s: s.battery.critical_action,
}


def _is_lost(loss: Loss, autopilot: "Autopilot", station: _Station) -> bool:
    """Return whether this is missing now."""
    match loss:
        case Loss.STATION:
            return station.is_lost(autopilot.now)
        case Loss.PILOT:
            return autopilot.pilot.lost
        case Loss.SETPOINTS:
            return autopilot.armed and autopilot.mode is Mode.GUIDED and autopilot.lacks_stream
        case Loss.BATTERY_LOW:
            return autopilot.battery.level >= Level.LOW
        case Loss.BATTERY_CRITICAL:
            return autopilot.battery.level >= Level.CRITICAL
