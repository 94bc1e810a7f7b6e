"""Where an outside vehicle is in the frame that all vehicles of a recording share (ENU).

Each has a local frame of its own, which begins where its estimator did. Horizontally they are
brought together by latitude and longitude. Heights stay those above each one's own beginning, the
ground it stood on: altitudes by GPS are metres off from one another.
"""

from math import inf, isfinite
from typing import NamedTuple

from ....transport.frames import Origin, Triple
from ....transport.mavlink import Message, mav

FARTHEST_M = 200_000.0  # from the shared origin: farther away is a mistake, no vehicle
_ROUNDING_M = 0.02  # of 1e-7 degrees
_LONGEST_S = 0.5  # between two positions that are compared
_PATIENCE_S = 2.0  # with a vehicle that has told degrees, and may tell metres
_AMSL = (mav.MAV_FRAME_GLOBAL, mav.MAV_FRAME_GLOBAL_INT)


class Spot(NamedTuple):
    """A place as it was told: metres in the vehicle's own NED, or degrees and a height."""

    local: Triple | None = None
    lat_lon_deg: tuple[float, float] | None = None
    up: float = 0.0  # with `lat_lon_deg`


class OwnFrame:
    """Where a vehicle's local frame begins: as it says, else as its two positions say together."""

    def __init__(self) -> None:
        self.origin: Origin | None = None
        self._first: tuple[float, Origin] | None = None  # when and where it first told degrees
        self._ground_m = 0.0  # above mean sea level, where its heights begin
        self._doubt_m = inf
        self._local: Triple | None = None
        self._local_at = -inf
        self._speed = 0.0

    def landmark(self, now: float) -> Origin | None:
        """Return a place that a shared frame may begin at: its own beginning, if that is told."""
        if self.origin is None and self._first and now - self._first[0] > _PATIENCE_S:
            return self._first[1]
        return self.origin

    def hear_local(self, place: Triple, speed: float, now: float) -> None:
        """Take in a LOCAL_POSITION_NED."""
        self._local, self._local_at, self._speed = place, now, speed

    def hear_global(self, m: Message, now: float) -> Spot | None:
        """Take in a GLOBAL_POSITION_INT; None for 0, 0, which says "not known"."""
        if not (m.lat or m.lon) or abs(m.lat) > 89e7:
            return None
        lat_lon_deg, up = (m.lat * 1e-7, m.lon * 1e-7), m.relative_alt * 1e-3
        self._ground_m = min(10_000.0, max(-500.0, m.alt * 1e-3 - up))
        here = Origin(*lat_lon_deg, self._ground_m)
        self._first = self._first or (now, here)
        apart = abs(now - self._local_at)
        doubt = _ROUNDING_M + apart * self._speed
        if self._local is not None and apart < _LONGEST_S and doubt < self._doubt_m / 2:
            north, east, _ = self._local
            self._doubt_m = doubt
            self.origin = Origin(*here.to_geodetic(-north, -east), self._ground_m)
        return Spot(lat_lon_deg=lat_lon_deg, up=up)

    def hear_origin(self, m: Message) -> None:
        """Take in a GPS_GLOBAL_ORIGIN, which leaves no doubt."""
        if m.latitude or m.longitude:
            place = (m.latitude * 1e-7, m.longitude * 1e-7, m.altitude * 1e-3)
            if abs(place[0]) <= 89 and -500 <= place[2] <= 10_000:
                self.origin, self._doubt_m = Origin(*place), 0.0

    def target_spot(self, m: Message) -> Spot | None:
        """Return the place in a POSITION_TARGET_LOCAL_NED or _GLOBAL_INT, set or told."""
        if m.get_type().endswith("_GLOBAL_INT"):
            if not (m.lat_int or m.lon_int) or abs(m.lat_int) > 89e7 or not isfinite(m.alt):
                return None
            up = m.alt - self._ground_m if m.coordinate_frame in _AMSL else m.alt
            return Spot(lat_lon_deg=(m.lat_int * 1e-7, m.lon_int * 1e-7), up=up)
        return local_spot(m) if m.coordinate_frame == mav.MAV_FRAME_LOCAL_NED else None


def local_spot(m: Message) -> Spot | None:
    """Return the place in a message that tells local NED; None when it is none."""
    place = (m.x, m.y, m.z)
    return Spot(local=place) if all(map(isfinite, place)) else None


def to_enu(spot: Spot, own: Origin | None, shared: Origin | None) -> Triple | None:
    """Return a spot in the shared frame; None where it cannot be drawn.

    Without a shared origin, or one of its own, a vehicle's local frame is taken for the shared one.
    """
    north = east = 0.0
    if own is not None and shared is not None:
        north, east = shared.from_geodetic(own.lat_deg, own.lon_deg)
    if spot.local is not None:
        north, east, up = north + spot.local[0], east + spot.local[1], -spot.local[2]
    elif shared is not None and spot.lat_lon_deg is not None:
        (north, east), up = shared.from_geodetic(*spot.lat_lon_deg), spot.up
    else:
        return None
    return (east, north, up) if max(abs(north), abs(east), abs(up)) < FARTHEST_M else None
