"""Where RTL goes: home, or the rally point that is nearest."""

from math import hypot
from typing import TYPE_CHECKING

from ..missions.shapes import rally_points
from ..robot import Vec3

if TYPE_CHECKING:
    from .autopilot import Autopilot


def destination(autopilot: "Autopilot") -> Vec3:
    """Return the place to return to, on the ground, in local NED.

    Rally points farther away than RALLY_LIMIT_KM are left out (0: none is); home competes with
    them where RALLY_INCL_HOME says so, and is taken when no rally point is near enough.
    """
    settings, home = autopilot.settings, autopilot.home
    k = autopilot.robot.kinematics()

    def away(place: Vec3) -> float:
        return hypot(place.north - k.north, place.east - k.east)

    points = [
        home._replace(north=north, east=east)
        for place in rally_points(autopilot.missions.rally.items)
        for north, east in [autopilot.origin.from_geodetic(place.lat_deg, place.lon_deg)]
    ]
    limit = settings.rally_limit
    near = [place for place in points if not limit or away(place) <= limit]
    if settings.rally_home or not near:
        near.append(home)
    return min(near, key=away)
