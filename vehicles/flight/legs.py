"""What each NAV item of a mission flies: a leg, from its beginning until it is done."""

from math import atan2, cos, hypot, inf, pi, radians, sin, sqrt
from typing import TYPE_CHECKING, Protocol

from ...transport.mavlink import mav
from ..config import SLICE_US
from ..missions.items import ABOVE_HOME, ABOVE_TERRAIN, Item
from ..robot import AttitudeSetpoint, Setpoint, Vec3
from .behaviour import HOLD
from .land import Land
from .rtl import CopterReturn
from .takeoff import Takeoff

if TYPE_CHECKING:
    from .autopilot import Autopilot

_UPDATE = SLICE_US * 1e-6  # s
_FACES_WAY = 1.0  # m: a shorter leg leaves the nose where it is
_CIRCLE_RADIUS = 10.0  # m, when an item gives none (CIRCLE_RADIUS)
_CIRCLE_RATE = radians(20)  # rad/s (CIRCLE_RATE)
_CENTRIPETAL = 2.0  # m/s^2
_LAG = 1.0  # m behind the reference on a circle at which the reference slows down
_LAG_MAX = 3.0  # m at which it waits


class Leg(Protocol):
    """One NAV item under way."""

    goal: Vec3 | None  # where it leads; at the end of a mission the vehicle stays there
    lifts: bool  # whether it may leave the ground

    def update(self) -> Setpoint | AttitudeSetpoint:
        """Return what to do now; called every 10 ms."""
        ...

    @property
    def lands(self) -> bool:
        """Whether it is letting itself down to the ground."""
        ...

    @property
    def done(self) -> bool:
        """Whether the item is completed, as of the last update."""
        ...


class WaypointLeg:
    """Goes to a place and stays there for `hold` seconds; the nose shows the way."""

    def __init__(
        self, autopilot: "Autopilot", goal: Vec3, *, radius: float = 0.0, hold: float = 0.0
    ) -> None:
        self._autopilot = autopilot
        self.goal: Vec3 | None = goal
        # A flight stack that starts missions by itself takes off for a waypoint, too.
        self.lifts, self.lands = autopilot.personality.missions_take_off, False
        self._setpoint = Setpoint(position=goal, yaw=_way(autopilot, goal))
        self._goal = goal
        self._radius = radius
        self._hold = hold
        self._arrived_at: float | None = None

    @property
    def done(self) -> bool:
        """Whether it was within the radius, and has stayed as long as asked."""
        since = self._arrived_at
        return since is not None and self._autopilot.now - since >= self._hold

    def update(self) -> Setpoint:
        """Return the place as a target."""
        autopilot = self._autopilot
        radius = self._radius or autopilot.settings.waypoint_radius
        if self._arrived_at is None and _distance(autopilot, self._goal) <= radius:
            self._arrived_at = autopilot.now
        return self._setpoint


class TakeoffLeg:
    """Climbs from where it stands; never down."""

    lifts = True
    lands = False

    def __init__(self, autopilot: "Autopilot", item: Item) -> None:
        down = place_of(autopilot, item).down
        highest = min(down, autopilot.robot.kinematics().down)
        self._climb = Takeoff(autopilot, autopilot.home.down - highest)
        self.goal: Vec3 | None = self._climb.position

    @property
    def done(self) -> bool:
        """Whether the height is reached."""
        return self._climb.done

    def update(self) -> Setpoint:
        """Return the height as a target."""
        return self._climb.setpoint


class LandLeg:
    """Flies to the place at the present height, if one is given, and lets down there."""

    lifts = False

    def __init__(self, autopilot: "Autopilot", item: Item) -> None:
        self._autopilot = autopilot
        self.goal: Vec3 | None = None
        self._approach: WaypointLeg | None = None
        self._land: Land | None = None
        if item.has_place:
            here = autopilot.robot.kinematics()
            above = place_of(autopilot, item)._replace(down=here.down)
            self._approach = WaypointLeg(autopilot, above)
            self.goal = above

    @property
    def lands(self) -> bool:
        """Whether it is over the place and on its way down."""
        return self._land is not None

    @property
    def done(self) -> bool:
        """Whether it stands on the ground."""
        return not self._autopilot.in_air

    def update(self) -> Setpoint | AttitudeSetpoint:
        """Return the approach, then the descent over the same point."""
        if self._approach is not None:
            setpoint = self._approach.update()
            if not self._approach.done:
                return setpoint
            k, point = self._autopilot.robot.kinematics(), self.goal
            over = None if point is None else point._replace(down=k.down)
            self._approach, self._land = None, Land(self._autopilot, over)
        if self._land is None:
            self._land = Land(self._autopilot)
        return self._land.update()


class ReturnLeg:
    """Returns home as mode RTL does, and lands."""

    lifts = False
    goal: Vec3 | None = None

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._return = CopterReturn(autopilot)

    @property
    def lands(self) -> bool:
        """Whether it is at home and on its way down."""
        return self._return.lands

    @property
    def done(self) -> bool:
        """Whether it stands on the ground."""
        return not self._autopilot.in_air

    def update(self) -> Setpoint | AttitudeSetpoint:
        """Return what mode RTL would do."""
        return self._return.update()


class DelayLeg:
    """Stays where it is for some seconds."""

    lifts = False
    lands = False
    goal: Vec3 | None = None

    def __init__(self, autopilot: "Autopilot", seconds: float) -> None:
        self._autopilot = autopilot
        self._until = autopilot.now + seconds

    @property
    def done(self) -> bool:
        """Whether the time is over."""
        return self._autopilot.now >= self._until

    def update(self) -> Setpoint:
        """Return "hold"."""
        return HOLD


class CircleLeg:
    """Goes to the nearest point of a circle, then round it `turns` times, facing its centre.

    A negative `radius` (m) turns left. The reference waits for a vehicle that cannot follow.
    """

    lifts = False
    lands = False

    def __init__(self, autopilot: "Autopilot", centre: Vec3, radius: float, turns: float) -> None:
        self._autopilot = autopilot
        self._centre = centre
        self._radius = abs(radius) or _CIRCLE_RADIUS
        self._side = -1.0 if radius < 0 else 1.0
        self._rate = min(_CIRCLE_RATE, sqrt(_CENTRIPETAL / self._radius))
        self._left = turns * 2 * pi  # rad still to go
        k = autopilot.robot.kinematics()
        self._angle = atan2(k.east - centre.east, k.north - centre.north)
        self.goal: Vec3 | None = self._point()
        self._entry: WaypointLeg | None = WaypointLeg(autopilot, self._point())

    @property
    def done(self) -> bool:
        """Whether it went round often enough."""
        return self._entry is None and self._left <= 0

    def update(self) -> Setpoint:
        """Return the way to the circle, then a point that runs round it."""
        if self._entry is not None:
            setpoint = self._entry.update()
            if not self._entry.done:
                return setpoint
            self._entry = None
        lag = _distance(self._autopilot, self._point())
        share = min(1.0, max(0.0, (_LAG_MAX - lag) / (_LAG_MAX - _LAG)))
        rate = self._side * self._rate * share
        self._angle += rate * _UPDATE
        self._left -= abs(rate) * _UPDATE
        self.goal = point = self._point()
        c, s = cos(self._angle), sin(self._angle)
        speed, inward = rate * self._radius, rate * rate * self._radius
        return Setpoint(
            position=point,
            velocity=Vec3(-s * speed, c * speed, 0.0),
            acceleration=Vec3(-c * inward, -s * inward, 0.0),
            yaw=self._angle + pi if self._autopilot.flies else None,
        )

    def _point(self) -> Vec3:
        r, centre = self._radius, self._centre
        return Vec3(
            centre.north + r * cos(self._angle), centre.east + r * sin(self._angle), centre.down
        )


def make_leg(autopilot: "Autopilot", item: Item) -> Leg:
    """Return the leg of a NAV item that begins here and now."""
    match item.command:
        case mav.MAV_CMD_NAV_TAKEOFF | mav.MAV_CMD_NAV_VTOL_TAKEOFF:
            return TakeoffLeg(autopilot, item)
        case mav.MAV_CMD_NAV_LAND | mav.MAV_CMD_NAV_VTOL_LAND:
            return LandLeg(autopilot, item)
        case mav.MAV_CMD_NAV_RETURN_TO_LAUNCH:
            if autopilot.flies:
                return ReturnLeg(autopilot)
            return WaypointLeg(autopilot, autopilot.home)
        case mav.MAV_CMD_NAV_DELAY:
            return DelayLeg(autopilot, item.param1)
        case mav.MAV_CMD_NAV_LOITER_TURNS:
            turns = item.param1 if item.param1 > 0 else 1.0
            return CircleLeg(autopilot, place_of(autopilot, item), item.param3, turns)
        case mav.MAV_CMD_NAV_LOITER_UNLIM:
            return WaypointLeg(autopilot, place_of(autopilot, item), hold=inf)
        case mav.MAV_CMD_NAV_LOITER_TIME:
            return WaypointLeg(autopilot, place_of(autopilot, item), hold=item.param1)
    goal = place_of(autopilot, item)
    return WaypointLeg(autopilot, goal, radius=max(0.0, item.param2), hold=item.param1)


def place_of(autopilot: "Autopilot", item: Item) -> Vec3:
    """Return an item's place in local NED; a latitude or height of 0 means the present one."""
    k = autopilot.robot.kinematics()
    north, east, down = k.north, k.east, k.down
    if item.has_place:
        north, east = autopilot.origin.from_geodetic(item.lat_deg, item.lon_deg)
    if item.z != 0:
        above_home = item.frame in (ABOVE_HOME, ABOVE_TERRAIN)
        zero = autopilot.home.down if above_home else autopilot.origin.alt_m
        down = zero - item.z
    return Vec3(north, east, down)


def _way(autopilot: "Autopilot", goal: Vec3) -> float | None:
    """Return the yaw of a copter that looks to `goal`, None where that is here."""
    k = autopilot.robot.kinematics()
    north, east = goal.north - k.north, goal.east - k.east
    return atan2(east, north) if autopilot.flies and hypot(north, east) > _FACES_WAY else None


def _distance(autopilot: "Autopilot", goal: Vec3) -> float:
    """Return how far a place is, for a rover on the map."""
    k = autopilot.robot.kinematics()
    rise = goal.down - k.down if autopilot.flies else 0.0
    return hypot(goal.north - k.north, goal.east - k.east, rise)
