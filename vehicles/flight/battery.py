"""A lithium battery: what the motors draw, how its voltage sags, and how empty it is.

It is an instrument, not physics: an empty battery does not slow the motors. What it says can
trigger failsafes (`failsafe.py`) and forbid arming (`arming.py`).
"""

from enum import IntEnum
from itertools import pairwise
from math import sqrt
from typing import TYPE_CHECKING

from ...transport.mavlink import mav

if TYPE_CHECKING:
    from .autopilot import Autopilot

FULL_CELL = 4.2  # V

_INTERVAL = 0.1  # s between two looks at the motors
_SOON = 1e-6  # s
_EFFICIENCY = {"quadcopter": 0.8, "rover": 0.6}  # of motors and their controllers
_ELECTRONICS = {"quadcopter": 5.0, "rover": 6.0}  # W, also while standing
_CELL_RESISTANCE = 0.008  # ohm
_LEAST_CAPACITY = 10.0  # mAh; less, or -1, says "unknown", as in the flight stacks
_USUAL_CAPACITY = 3300.0  # mAh
_CURVE = (  # charge left, V of a resting cell as a share of a full one
    (0.0, 0.71),
    (0.05, 0.83),
    (0.1, 0.865),
    (0.2, 0.885),
    (0.4, 0.905),
    (0.6, 0.925),
    (0.8, 0.96),
    (1.0, 1.0),
)


class Level(IntEnum):
    """How empty the battery is by the user's limits. In flight it only gets worse."""

    OK = mav.MAV_BATTERY_CHARGE_STATE_OK
    LOW = mav.MAV_BATTERY_CHARGE_STATE_LOW
    CRITICAL = mav.MAV_BATTERY_CHARGE_STATE_CRITICAL


class Battery:
    """The vehicle's one battery. `update` is called every 10 ms and works every 100 ms."""

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._settings = autopilot.settings.battery
        self._due = 0.0
        self.level = Level.OK
        self._begin()

    @property
    def present(self) -> bool:
        """Whether there is a battery to report on (BATT_MONITOR)."""
        return self._settings.monitor != 0

    @property
    def capacity_mah(self) -> float:
        """Return what a full battery holds."""
        capacity = self._settings.capacity_mah
        return capacity if capacity > _LEAST_CAPACITY else _USUAL_CAPACITY

    @property
    def remaining(self) -> float:
        """Return the charge that is left, 0..1."""
        return min(1.0, max(0.0, 1 - self.consumed_mah / self.capacity_mah))

    @property
    def cells(self) -> int:
        """Return the number of cells in series."""
        return max(1, round(self._settings.full_voltage / FULL_CELL))

    @property
    def charge_state(self) -> int:
        """Return MAV_BATTERY_CHARGE_STATE."""
        return int(self.level) if self.present else int(mav.MAV_BATTERY_CHARGE_STATE_UNDEFINED)

    def update(self) -> None:
        """Take from the battery what was drawn since the last look."""
        now = self._autopilot.now
        if now < self._due:
            return
        self._due = now + _INTERVAL - _SOON
        if self._settings.charge != self._initial_charge:
            self._begin()  # somebody has set the charge: a fresh battery
        self.consumed_mah += self.current * _INTERVAL / 3.6
        self._sag()
        self._judge(now)

    def refusal(self) -> str | None:
        """Return why this battery forbids arming, as ArduPilot words it; None if it does not."""
        if not self.present:
            return None
        s = self._settings
        left = self.capacity_mah - self.consumed_mah
        reasons = (
            (self.voltage < s.arming_voltage, "below minimum arming voltage"),
            (left < s.arming_mah, "below minimum arming capacity"),
            (self.voltage < s.low_voltage, "low voltage failsafe"),
            (self._is_empty(s.low_mah, s.low_charge), "low capacity failsafe"),
            (self.voltage < s.critical_voltage, "critical voltage failsafe"),
            (self._is_empty(s.critical_mah, s.critical_charge), "critical capacity failsafe"),
            (0 < s.low_mah <= s.critical_mah, "capacity failsafe critical >= low"),
            (0 < s.low_voltage <= s.critical_voltage, "voltage failsafe critical >= low"),
        )
        return next((f"Battery 1 {text}" for applies, text in reasons if applies), None)

    def _begin(self) -> None:
        """Put in a battery that is as full as the settings say."""
        self._initial_charge = self._settings.charge
        charge = min(1.0, max(0.0, self._initial_charge))
        self.consumed_mah = (1 - charge) * self.capacity_mah
        self.current = 0.0  # A
        self.voltage = 0.0  # V, under load
        self._low_since: float | None = None
        self._critical_since: float | None = None
        self._sag()

    def _sag(self) -> None:
        """Find the current that gives the power wanted behind the battery's resistance.

        P = (U0 - R I) I; where no current gives so much, the one that gives most.
        """
        kind = self._autopilot.config.kind
        power = self._autopilot.robot.shaft_power() / _EFFICIENCY[kind] + _ELECTRONICS[kind]
        resting = self._settings.full_voltage * _resting(self.remaining)
        resistance = self.cells * _CELL_RESISTANCE
        root = sqrt(max(0.0, resting * resting - 4 * resistance * power))
        self.current = (resting - root) / (2 * resistance)
        self.voltage = resting - resistance * self.current

    def _judge(self, now: float) -> None:
        """Compare with the user's limits: in flight the level only gets worse."""
        if not (self._autopilot.armed and self.present):
            self.level = Level.OK
            self._low_since = self._critical_since = None
            return
        s = self._settings
        self._low_since = _since(self._low_since, self.voltage < s.low_voltage, now)
        self._critical_since = _since(self._critical_since, self.voltage < s.critical_voltage, now)
        if self._lasts(self._critical_since) or self._is_empty(s.critical_mah, s.critical_charge):
            self.level = Level.CRITICAL
        elif self._lasts(self._low_since) or self._is_empty(s.low_mah, s.low_charge):
            self.level = max(self.level, Level.LOW)

    def _lasts(self, since: float | None) -> bool:
        """Return whether a voltage is too low for longer than BATT_LOW_TIMER (0: never)."""
        timer = self._settings.low_timer
        return since is not None and 0 < timer < self._autopilot.now - since

    def _is_empty(self, least_mah: float, least_charge: float) -> bool:
        """Return whether less than this is left; a limit of 0 is none."""
        left = self.capacity_mah - self.consumed_mah
        return left < least_mah or self.remaining < least_charge


def _since(since: float | None, applies: bool, now: float) -> float | None:
    """Return since when something applies."""
    if not applies:
        return None
    return now if since is None else since


def _resting(charge: float) -> float:
    """Return the voltage without load, as a share of the full one."""
    for (low, below), (high, above) in pairwise(_CURVE):
        if charge <= high:
            return below + (above - below) * (charge - low) / (high - low)
    return _CURVE[-1][1]
