"""Where the local frame of an external vehicle lies in the fleet's. No I/O.

Its frame begins where its estimator did: another latitude and longitude, and an altitude by GPS
that can be metres wrong. Horizontally the two are brought together by GPS_GLOBAL_ORIGIN;
vertically by the ground the vehicle stands on, which is the fleet's height 0. That a vehicle is
not flown by an origin it no longer has, its GLOBAL_POSITION_INT has to agree.
"""

from math import hypot, isfinite

from ...transport.frames import Origin, Triple

FARTHEST_M = 10_000.0  # from the fleet's origin: beyond, north is no longer north
# Both positions come from one estimator, so little is between them: the moments they are told at,
# 1 cm of rounding, and the figure of the earth by which each stack makes metres of degrees
# (spheres: up to 0.5 % of the distance). Three metres are far more, and less than a wrong origin.
TOLERANCE_M = 3.0
_PER_METRE = 0.006  # of distance from its own origin
_DELAY_S = 0.5  # between the two positions
_MOVED_M = 0.5  # an origin that is told again is the same within rounding
_JUMP_M = 0.7  # of height: no noise, but another estimator (ArduPilot's first has no altitude)
_SETTLE_S = 1.0  # of the mean of the ground's height
_DOUBTS = 3  # disagreements in a row


class Alignment:
    """Brings one vehicle's local NED into the fleet's.

    `problem`: why it must not be flown; "": nothing. `waits_for`: what is missing; "": nothing.
    """

    def __init__(self, fleet: Origin) -> None:
        self._fleet = fleet
        self.forget()

    def forget(self) -> None:
        """Start again: the vehicle has."""
        self.problem = ""
        self._origin: Origin | None = None
        self._north = self._east = 0.0  # of its origin
        self._ground: float | None = None  # its local `down` where it stands
        self._local: Triple | None = None
        self._speed = 0.0
        self._local_at = 0.0
        self._verified = False
        self._off = 0.0  # m between the two positions when last compared
        self._doubts = 0

    @property
    def aligned(self) -> bool:
        """Whether its positions mean something in the fleet's frame."""
        return not self.waits_for

    @property
    def waits_for(self) -> str:
        """What is still missing, in words."""
        if self._local is None:
            return "it has no local position yet (ArduPilot: some 20 s after boot)"
        if self._origin is None:
            return "it has not told its origin yet (GPS_GLOBAL_ORIGIN)"
        if self._ground is None:
            return "it is armed, and has not told its home (HOME_POSITION)"
        if self._doubts:
            return (
                f"its LOCAL_POSITION_NED and GLOBAL_POSITION_INT are {self._off:.1f} m apart, "
                f"more than {TOLERANCE_M:g} m: is its estimator still settling?"
            )
        return "" if self._verified else "its position is not verified (GLOBAL_POSITION_INT)"

    @property
    def shift(self) -> Triple:
        """What to add to its local NED."""
        return self._north, self._east, -(self._ground or 0.0)

    def to_fleet(self, local: Triple) -> Triple:
        """Return a place of its local NED in the fleet's."""
        n, e, d = self.shift
        return local[0] + n, local[1] + e, local[2] + d

    def to_local(self, place: Triple) -> Triple:
        """Return a place of the fleet's NED in its own."""
        n, e, d = self.shift
        return place[0] - n, place[1] - e, place[2] - d

    def hear_origin(self, origin: Origin, *, armed: bool) -> None:
        """Take in where its frame begins."""
        north, east = self._fleet.from_geodetic(origin.lat_deg, origin.lon_deg)
        moved = hypot(north - self._north, east - self._east)
        if self._origin is not None:
            if self._ground is not None:  # its heights count from there, too
                self._ground += origin.alt_m - self._origin.alt_m
            if moved < _MOVED_M:
                self._origin = origin
                return
            if armed:
                self.problem = f"its origin moved by {moved:.1f} m while it was armed"
                return
        elif not armed:
            self._ground = None  # PX4 tells heights before it has an origin
        self._origin, self._north, self._east = origin, north, east
        self._verified, self._doubts, self.problem = False, 0, ""
        if (away := hypot(north, east)) > FARTHEST_M:
            self.problem = (
                f"its origin {_text(origin)} is {away / 1000:.0f} km from the fleet's "
                f"{_text(self._fleet)} (correct `origin:` in the scenario, or start the simulator "
                f"there: --home {self._fleet.lat_deg:.7f},{self._fleet.lon_deg:.7f},"
                f"{self._fleet.alt_m:g},0)"
            )

    def hear_local(self, position: Triple, velocity: Triple, now: float, *, stands: bool) -> None:
        """Take in a LOCAL_POSITION_NED; what `stands` is on the ground."""
        if not all(map(isfinite, (*position, *velocity))):
            return
        down = position[2]
        if stands:
            if self._ground is None or abs(down - self._ground) > _JUMP_M:
                self._ground = down
            share = min(1.0, max(0.0, now - self._local_at) / _SETTLE_S)
            self._ground += share * (down - self._ground)
        self._local, self._local_at, self._speed = position, now, hypot(*velocity[:2])

    def hear_home(self, down: float) -> None:
        """Take in its home's local `down`; counts for a vehicle first heard of in the air."""
        if self._ground is None and self._origin is not None and isfinite(down):
            self._ground = down

    def hear_global(self, lat_deg: float, lon_deg: float, now: float, *, armed: bool) -> None:
        """Compare the place that it tells in degrees with the one in metres."""
        if self._origin is None or self._local is None or now - self._local_at > _DELAY_S:
            return
        north, east = self._fleet.from_geodetic(lat_deg, lon_deg)
        n, e, _ = self.to_fleet(self._local)
        self._off = hypot(north - n, east - e)
        tolerance = TOLERANCE_M + _PER_METRE * hypot(*self._local[:2]) + _DELAY_S * self._speed
        if self._off <= tolerance:
            self._verified, self._doubts = True, 0
            return
        if not armed:
            self._verified, self._doubts = False, self._doubts + 1
        elif self._verified:
            self._doubts += 1
            if self._doubts >= _DOUBTS:
                self.problem = (
                    f"its LOCAL_POSITION_NED and GLOBAL_POSITION_INT are {self._off:.1f} m apart "
                    "while it is armed: its origin has moved"
                )


def _text(origin: Origin) -> str:
    return f"{origin.lat_deg:.5f}, {origin.lon_deg:.5f}"
