"""Arming and disarming: the checks, the reasons, and who disarms by himself.

Kinder than ArduPilot on purpose: a copter that stands on the ground may be armed in BRAKE and in
LAND, because ground stations put it there and then wonder.
"""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, NamedTuple

from ...transport.mavlink import mav
from .modes import Mode
from .wording import Disarming, wording

if TYPE_CHECKING:
    from .autopilot import Autopilot

ACCEPTED: int = mav.MAV_RESULT_ACCEPTED
FAILED: int = mav.MAV_RESULT_FAILED

_LANDS = (Mode.LAND, Mode.RTL, Mode.AUTO)
_BY_STICKS = (Mode.STABILIZE, Mode.ALT_HOLD, Mode.LOITER)
_REPEAT = 30.0  # s between two "PreArm" texts
_ANY, _ALL, _RC, _BATTERY = 0, 1, 1 << 6, 1 << 8  # ARMING_CHECK


class _Check(NamedTuple):
    """One thing that may hinder arming."""

    bit: int  # of ARMING_CHECK; _ANY: whatever is checked, unless nothing is
    refusal: Callable[["Autopilot"], str | None]


class Arming:
    """Decides whether the motors may run. Results are MAV_RESULTs."""

    def __init__(self, autopilot: "Autopilot") -> None:
        self.armed = False
        self._autopilot = autopilot
        self._words = wording(autopilot.personality.name, autopilot.config.kind).arming
        self._has_flown = False
        self._stands_since = 0.0  # s since boot, armed
        self._complained_at = 0.0
        self._is_born = False

    def refusal(self) -> str | None:
        """Return why the vehicle cannot be armed now, None when it can."""
        return self._mode_refusal() or self.prearm_refusal()

    def prearm_refusal(self) -> str | None:
        """Return what hinders arming in any mode, as ArduPilot's PREARM_CHECK bit means it."""
        return next(self._hindrances(), None)

    def run_checks(self) -> int:
        """Say everything that hinders arming: RUN_PREARM_CHECKS."""
        if self.armed:
            return int(mav.MAV_RESULT_TEMPORARILY_REJECTED)
        self._complain()
        return ACCEPTED

    def arm(self, *, force: bool = False) -> int:
        """Arm, or say why not; `force` skips the checks."""
        autopilot = self._autopilot
        if self.armed:
            return ACCEPTED
        if not force and (reason := self.refusal()):
            for text in self._words.refused:
                autopilot.say(text.format(reason), mav.MAV_SEVERITY_CRITICAL)
            return autopilot.personality.arming_refusal
        self.armed = True
        self._has_flown = autopilot.in_air
        self._stands_since = autopilot.now
        autopilot.on_arming()
        autopilot.say(self._words.armed)
        return ACCEPTED

    def disarm(self, *, force: bool = False, because: Disarming = Disarming.COMMAND) -> int:
        """Disarm; in the air only by force."""
        autopilot = self._autopilot
        if autopilot.in_air and self.armed and not force:
            line = self._words.in_air
            autopilot.say(line.text, line.severity)
            return autopilot.personality.arming_refusal
        if self.armed:
            self.armed = False
            self._complained_at = autopilot.now
            autopilot.on_arming()
            autopilot.say(self._words.disarmed_because.get(because, self._words.disarmed))
        return ACCEPTED

    def watch(self) -> None:
        """Disarm a copter that has landed or was never flown; repeat what hinders arming.

        Called every 10 ms. A rover stays armed, as ArduRover does.
        """
        autopilot = self._autopilot
        if not self.armed:
            self._be_born()
            if autopilot.now - self._complained_at >= _REPEAT:
                self._complain()
        elif autopilot.in_air:
            self._has_flown = True
            self._stands_since = autopilot.now
        elif not autopilot.flies or self._is_leaving():
            self._stands_since = autopilot.now
        else:
            self._watch_standing()

    def _watch_standing(self) -> None:
        """Disarm a copter that has stood on the ground for long enough."""
        autopilot, settings = self._autopilot, self._autopilot.settings
        landing = self._has_flown and (self._words.any_landing or autopilot.mode in _LANDS)
        delay = settings.landed_disarm_delay if landing else settings.disarm_delay
        if delay and autopilot.now - self._stands_since > delay:
            self.disarm(because=Disarming.LANDED if landing else Disarming.IDLE)

    def _is_leaving(self) -> bool:
        """Return whether something is about to lift a standing copter.

        GUIDED may lift it at any time where targets take off: until one does, it stands.
        """
        autopilot = self._autopilot
        guided = autopilot.mode is Mode.GUIDED
        return autopilot.climb is not None or (autopilot.behaviour.lifts and not guided)

    def _be_born(self) -> None:
        """Arm at boot where arming is not required (ARMING_REQUIRE 0)."""
        if not self._is_born:
            self._is_born = True
            if not self._autopilot.settings.arming_required:
                self.arm(force=True)

    def _complain(self) -> None:
        """Say what hinders arming."""
        self._complained_at = self._autopilot.now
        for reason in self._hindrances():
            self._autopilot.say(self._words.hindered.format(reason), mav.MAV_SEVERITY_CRITICAL)

    def _hindrances(self) -> Iterator[str]:
        """Yield what hinders arming in any mode, of what ARMING_CHECK wants checked."""
        wanted = self._autopilot.settings.arming_checks
        for check in _CHECKS:
            counts = wanted & (check.bit | _ALL) or check.bit == _ANY
            if wanted and counts and (reason := check.refusal(self._autopilot)):
                yield reason

    def _mode_refusal(self) -> str | None:
        """Return why this vehicle cannot be armed in this mode and place, whatever is checked."""
        autopilot = self._autopilot
        mode = autopilot.mode
        if mode in autopilot.modes.not_armable:
            return self._words.not_armable.format(autopilot.modes.name(mode))
        if mode is Mode.AUTO and not autopilot.missions.mission.items:
            return "Mode requires mission"
        if autopilot.in_air:
            return "in the air"
        if autopilot.wants_reboot:
            return "rebooting"
        if mode is Mode.GUIDED and autopilot.lacks_stream:
            return "Offboard needs setpoints"
        return None


def _battery_refusal(autopilot: "Autopilot") -> str | None:
    return autopilot.battery.refusal()


def _fence_refusal(autopilot: "Autopilot") -> str | None:
    return autopilot.fence.arming_refusal()


def _loss_refusal(autopilot: "Autopilot") -> str | None:
    return autopilot.failsafes.refusal()


def _throttle_refusal(autopilot: "Autopilot") -> str | None:
    """Return that a copter would jump up, None when it would not."""
    jumps = autopilot.mode in _BY_STICKS and autopilot.behaviour.lifts
    return "Throttle too high" if jumps else None


_CHECKS = (
    _Check(_BATTERY, _battery_refusal),
    _Check(_ANY, _fence_refusal),
    _Check(_ANY, _loss_refusal),
    _Check(_RC, _throttle_refusal),
)
