"""A scenario as typed data: what the loader makes of YAML and what everything else reads.

Ground side: ENU, SI, radians. Angles in YAML are in degrees and named so.
"""

from dataclasses import dataclass, field

from ..transport.frames import Origin, Triple
from ..vehicles.config import Disturbance


@dataclass(frozen=True, slots=True)
class Point:
    """A place in ENU, metres from the fleet origin; `up` is None where height is the vehicle's."""

    east: float
    north: float
    up: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Hold:
    """Stay at `at` (default: above the start) until every path has ended."""

    at: Point | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Goto:
    """Move straight to `target`; arrival is within 0.2 m."""

    target: Point


@dataclass(frozen=True, slots=True, kw_only=True)
class Circle:
    """Follow a circle at constant speed."""

    centre: Point
    radius: float  # m
    speed: float = 0.5  # m/s
    clockwise: bool = False
    start_angle: float = 0.0  # rad, counter-clockwise from east
    laps: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Rectangle:
    """Follow a rectangle counter-clockwise from its south-west `corner`, at constant speed."""

    corner: Point
    width: float  # m, east
    height: float  # m, north
    speed: float = 0.5
    clockwise: bool = False
    laps: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Waypoints:
    """Follow straight legs through `points` at constant speed; all name a height, or none does."""

    points: tuple[Point, ...]
    speed: float = 0.5

    def __post_init__(self) -> None:
        if len({point.up is None for point in self.points}) != 1:
            raise ValueError("waypoints must all name a height, or none of them")


Path = Hold | Goto | Circle | Rectangle | Waypoints


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotSpec:
    """One robot of the team."""

    name: str  # at most 16 ASCII letters, digits, '-' or '_'
    kind: str  # quadcopter | rover
    system_id: int
    start: Point  # where it stands
    heading: float = 0.0  # rad, counter-clockwise from east
    path: Path = Hold()
    dwell_s: float = 0.0  # at the end of the path
    then: str = "land"  # land | return (fly back to the pad and land) | stay; rovers just stop
    profile: str = "default"
    params: dict[str, float] = field(default_factory=dict)
    disturbance: Disturbance | None = None  # None: the scenario's
    autopilot: str = "ardupilot"  # ardupilot | px4 | generic; auto, if external: what it says
    connect: str | None = None  # where an external vehicle is reached; None: one of our own
    max_speed: float | None = None  # m/s, for coordination; None: v_max of profile and params

    @property
    def external(self) -> bool:
        """Whether somebody else has started this vehicle, real or simulated."""
        return self.connect is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class Fence:
    """The box (ENU, m from the fleet origin) that no robot may be sent out of."""

    east: tuple[float, float]  # least, greatest
    north: tuple[float, float]
    up: float  # greatest height

    def holds(self, place: Triple) -> bool:
        """Return whether a place is inside, or on the border."""
        east, north, up = place
        level = self.east[0] <= east <= self.east[1] and self.north[0] <= north <= self.north[1]
        return level and up <= self.up


@dataclass(frozen=True, slots=True, kw_only=True)
class Team:
    """How the team is coordinated."""

    law: str = "safe"
    rate_hz: float = 20.0  # coordination period
    start_sigma_m: float = 0.2  # drawn by the seed, on each start position
    takeoff_up: float = 2.0  # m, for quadcopters whose path names no height
    setpoint_timeout_s: float = 0.5  # GUID_TIMEOUT of every vehicle
    state_timeout_s: float = 1.0  # a state older than this is unknown
    coordinators: str = "central"  # central | per-robot
    ready_timeout_s: float = 120.0  # for external vehicles to get ready to arm
    at_end: str = "land"  # what external vehicles do when a run is broken off: land | hold | return
    law_params: dict[str, float] = field(default_factory=dict)  # k_f, kappa, ... by name
    law_at: str = field(default="", compare=False, repr=False)  # where it is written, for errors
    law_params_at: str = field(default="", compare=False, repr=False)

    @property
    def period_us(self) -> int:
        """Return the length of a tick."""
        return round(1.0 / self.rate_hz * 1e6)


@dataclass(frozen=True, slots=True, kw_only=True)
class Expect:
    """Assertions that decide pass or fail; None asserts nothing."""

    collisions: int | None = None
    all_arrive_within_s: float | None = None
    tracking_rmse_m: dict[str, float] = field(default_factory=dict)  # by robot name
    min_separation_m: float | None = None  # centre to centre, any pair


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """A whole run, resolved: counts expanded, system ids given, defaults filled in."""

    name: str
    robots: tuple[RobotSpec, ...]
    description: str = ""
    duration: float = 60.0  # s of fleet time; longer is a time-out
    seed: int = 1
    origin: Origin = field(default_factory=Origin)
    team: Team = Team()
    disturbance: Disturbance = field(default_factory=Disturbance)
    expect: Expect = Expect()
    fence: Fence | None = None
