"""When an external vehicle may be steered: not before its preflight finds nothing missing."""

import re
from collections.abc import Callable

from ...scenarios.schema import RobotSpec, Scenario
from ..station import Station, StationError
from .inquiry import Inquiry
from .preflight import Check, checklist, missing

COMPLAINT_S = 30.0  # of its line: it is not the vehicle that is wanted, or it is not there
_LASTS_S = 1.0  # what is missing for a shorter time is not worth a word
_NUMBER = re.compile(r"-?\d+(\.\d+)?")  # what is missing stays the same when only these change


class Clearance:
    """Asked once a tick, whether its vehicle may be steered.

    Until the vehicle has begun, it is taken back when something is missing again, unless it
    `lasts`: then once `given` it stays. A reboot always takes it back.
    """

    def __init__(
        self,
        spec: RobotSpec,
        scenario: Scenario,
        station: Station,
        tell: Callable[[str, str], None],
        *,
        lasts: bool = False,
    ) -> None:
        self.given = False
        self._lasts = lasts
        self._boots = 0
        self._spec = spec
        self._scenario = scenario
        self._station = station
        self._inquiry = Inquiry(station)
        self._tell = tell
        self._asked_at: float | None = None  # when it was asked for first
        self._fine_at = 0.0  # when its line last had nothing to complain of
        self._absent = ""  # what is missing, but for its numbers
        self._absent_since = 0.0
        self._told = ""

    def update(self, now: float, complaint: str, *, begun: bool) -> None:
        """Look again; `complaint` is its line's. Raises StationError when it will not be given.

        So it does when a vehicle that has `begun` reboots, of which nothing holds any more.
        """
        if self._station.problem:
            raise StationError(self._station.problem)
        if self._station.status.boots != self._boots:
            self._boots = self._station.status.boots
            self._take_back(now)
            if begun:
                raise StationError(f"{self._spec.name}: has rebooted at {now:.1f} s")
        if self.given and (begun or self._lasts):
            return
        if self._asked_at is None:
            self._asked_at = self._fine_at = now
        if not complaint:
            self._fine_at = now
        elif now - self._fine_at > COMPLAINT_S:
            raise StationError(f"{self._spec.name}: {complaint}")
        self._inquiry.update(now)
        absent = missing(checklist(self._station, self._spec, self._scenario, now))
        if not absent and not complaint:
            if not self.given:
                self._tell("preflight", "ready")
            self.given = True
            return
        if self.given:
            self._take_back(now)
        what = complaint or _listed(absent)
        kind = _NUMBER.sub("", what)
        if kind != self._absent:
            self._absent, self._absent_since = kind, now
        patience = self._scenario.team.ready_timeout_s
        if now - self._asked_at > patience:
            raise StationError(f"{self._spec.name}: not ready after {patience:g} s: {what}")
        if kind != self._told and now - self._absent_since >= _LASTS_S:
            self._told = kind
            self._tell("preflight", f"waits for {what}")

    def _take_back(self, now: float) -> None:
        self.given = False
        self._asked_at = self._fine_at = now
        self._told = ""


def _listed(absent: list[Check]) -> str:
    return "; ".join(
        f"{check.name}: {check.text}" + (f" ({check.cure})" if check.cure else "")
        for check in absent
    )
