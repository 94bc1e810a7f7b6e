"""What must be true of an external vehicle before anything arms, and what is missing. No I/O.

Each check is a pure look at what the vehicle has told its station. One whose premise is missing
(a position without a link) is unknown rather than wrong, so that what is wrong stands out.
"""

from collections.abc import Iterator, Mapping, Sequence
from math import degrees, hypot, isfinite
from typing import NamedTuple

from ...scenarios.paths import extremes
from ...scenarios.schema import RobotSpec, Scenario
from ...transport.frames import swap_ned_enu, swap_yaw
from ..station import PX4, Question, Station, VehicleStatus, stack_of
from ..station.identity import mismatch

HEARD_S = 3.0  # a heartbeat older than this is no link
FRESH_S = 3.0  # and a position older than this is none
PLACE_M = 2.0  # from the scenario's start; the mission begins from where the vehicle stands
BATTERY = 0.3  # of full
STANDING = 0.3  # m/s, and less: no more than an estimate's noise

_AT_ONCE_S = 1.0  # reasons that come together

_NO_FIX = 2  # GPS_RAW_INT.fix_type: 2D; 3 and more are positions
_CIRCLE = 2  # bit of FENCE_TYPE
_FENCE_PARAMETERS = {
    "ardupilot": ("FENCE_ENABLE", "FENCE_TYPE", "FENCE_RADIUS"),
    "px4": ("GF_MAX_HOR_DIST",),
}
_FIX_NAMES = ("no GPS", "no fix", "2D fix", "3D fix", "DGPS fix", "RTK float", "RTK fixed")
_REFUSALS = ("PreArm: ", "Arm: ", "Preflight Fail: ", "Arming denied: ")


class Check(NamedTuple):
    """One thing that was looked at."""

    name: str  # link, identity, position, origin, place, battery, fence, ready
    ok: bool | None  # None: not known (yet)
    text: str  # what was found
    cure: str = ""
    required: bool = True  # before the vehicle may arm


class Preflight(NamedTuple):
    """What the checks look at."""

    station: Station
    spec: RobotSpec
    scenario: Scenario
    now: float
    fence: Mapping[str, Question]

    @property
    def status(self) -> VehicleStatus:
        """What the vehicle said last."""
        return self.station.status


def checklist(
    station: Station,
    spec: RobotSpec,
    scenario: Scenario,
    now: float,
    fence: Mapping[str, Question] | None = None,
) -> list[Check]:
    """Return every check of one external vehicle at fleet time `now`, the most basic first.

    `fence` is what `ask_fence` returned, where somebody wants to know.
    """
    return list(_checks(Preflight(station, spec, scenario, now, fence or {})))


def ask_fence(station: Station, now: float) -> dict[str, Question]:
    """Ask the vehicle for the parameters of its own fence; none while its stack is not known."""
    names = _FENCE_PARAMETERS.get(station.stack.name, ()) if station.stack else ()
    return {name: station.parameters.read(name, now) for name in names}


def missing(checks: Sequence[Check]) -> list[Check]:
    """Return what keeps the vehicle from arming: what is wrong, or else what is not yet known."""
    needed = [check for check in checks if check.required and check.ok is not True]
    return [check for check in needed if check.ok is False] or needed


def _checks(p: Preflight) -> Iterator[Check]:
    link = _link(p)
    yield link
    for name, look in _AFTER_LINK.items():
        yield look(p) if link.ok else Check(name, None, "", required=name != "fence")


def _link(p: Preflight) -> Check:
    at = p.status.heartbeat_at
    age = p.now - at
    if at >= 0 and age < HEARD_S:
        return Check("link", True, f"heartbeat {max(0.0, age):.1f} s ago")
    where = p.spec.connect or "its link"
    if at < 0:
        cure = "start the vehicle, or mend `connect` in the scenario"
        return Check("link", False, f"nothing heard on {where}", cure)
    return Check("link", False, f"silent for {age:.0f} s on {where}", "look at cable or radio")


def _identity(p: Preflight) -> Check:
    if wrong := _mismatch(p):
        return Check("identity", False, wrong)
    stack = p.station.stack
    version = f" {'.'.join(map(str, p.status.version))}" if p.status.version else ""
    who = f"{stack.name if stack else 'unknown'}{version} {p.spec.kind}"
    return Check("identity", True, f"{who}, system {p.station.system_id}")


def _mismatch(p: Preflight) -> str:
    mav_type, autopilot = p.status.mav_type, p.status.autopilot
    if mav_type is None or autopilot is None:
        return ""
    return mismatch(p.spec.kind, stack_of(p.spec.autopilot), mav_type, autopilot)


def _position(p: Preflight) -> Check:
    s = p.status
    told = _FIX_NAMES[min(s.gps_fix, len(_FIX_NAMES) - 1)] if s.gps_fix is not None else ""
    if told and s.satellites is not None:
        told += f", {s.satellites} satellites"
    if s.gps_fix is not None and s.gps_fix <= _NO_FIX:
        return Check("position", False, told, "wait for GPS, under open sky")
    at = max(s.position_at, s.global_position_at if s.global_position else -1.0)
    also = f"; {told}" if told else ""
    if at < 0 and s.sensors is None and s.gps_fix is None:
        cure = "wait; if it stays so, it must let system 254 in (ArduPilot: SYSID_ENFORCE 0)"
        return Check("position", False, "it tells nothing but heartbeats", cure)
    if at < 0:
        cure = "wait: after boot it takes some 20 s"
        return Check("position", False, f"no position yet{also}", cure)
    if (age := p.now - at) > FRESH_S:
        cure = "look at the link, and at the vehicle's estimator"
        return Check("position", False, f"no position for {age:.0f} s{also}", cure)
    return Check("position", True, told or "known")


def _origin(p: Preflight) -> Check:
    if p.station.problem and not _mismatch(p):
        return Check("origin", False, p.station.problem.removeprefix(f"{p.spec.name}: "))
    if p.station.waits_for:
        return Check("origin", None, p.station.waits_for)
    ours, theirs = p.scenario.origin, p.status.origin or p.scenario.origin
    away = hypot(*ours.from_geodetic(theirs.lat_deg, theirs.lon_deg))
    return Check("origin", True, f"{away:.1f} m from the fleet's; positions agree")


def _place(p: Preflight) -> Check:
    if p.status.position_at < 0 or p.station.problem:
        return Check("place", None, "where it stands is not known")
    east, north, _ = swap_ned_enu(p.status.position)
    start = p.spec.start
    off = hypot(east - start.east, north - start.north)
    fence = p.scenario.fence
    if fence and not fence.holds((east, north, 0.0)):
        text = f"stands at east {east:z.1f}, north {north:z.1f}, outside the fence"
        return Check("place", False, text, "move it inside, or widen `fence` in the scenario")
    if off <= PLACE_M:
        return Check("place", True, f"{off:.1f} m from its start")
    text = f"stands at east {east:z.1f}, north {north:z.1f}, {off:.1f} m from its start"
    return Check("place", False, text, _way_to_start(p, east, north))


def _way_to_start(p: Preflight, east: float, north: float) -> str:
    """Return how a vehicle, or a simulated one, gets to the scenario's start."""
    start, origin = p.spec.start, p.scenario.origin
    lat, lon = origin.to_geodetic(start.north, start.east)
    compass = round(degrees(swap_yaw(p.spec.heading)) % 360, 1) % 360
    home = f"--home={lat:.7f},{lon:.7f},{origin.alt_m:g},{compass:g}"
    if p.station.stack is PX4:
        home = f"PX4_HOME_LAT={lat:.7f} PX4_HOME_LON={lon:.7f} PX4_HOME_ALT={origin.alt_m:g}"
    return (
        f"move it to east {start.east:zg}, north {start.north:zg}; or set its"
        f" `start: {{east: {east:z.1f}, north: {north:z.1f}}}`;"
        f" a simulator starts there with {home}"
    )


def _battery(p: Preflight) -> Check:
    left, volts = p.status.battery_remaining, p.status.battery_v
    volt = f", {volts:.1f} V" if volts else ""
    if left is None:
        return Check("battery", None, f"charge not told{volt}", required=False)
    if left < BATTERY:
        cure = f"charge it to {BATTERY:.0%} or more"
        return Check("battery", False, f"{left:.0%} left{volt}", cure)
    return Check("battery", True, f"{left:.0%} left{volt}")


def _fence(p: Preflight) -> Check:
    """Tell of the vehicle's own fence, which nobody needs, but which surprises those who forgot."""
    values = {name: q.value for name, q in p.fence.items()}
    told = {name: v for name, v in values.items() if v is not None and isfinite(v)}
    radius = told.get("FENCE_RADIUS", told.get("GF_MAX_HOR_DIST"))
    if radius is None or not all(question.done for question in p.fence.values()):
        return Check("fence", None, "its own: not told", required=False)
    circle = int(told.get("FENCE_TYPE", _CIRCLE)) & _CIRCLE
    if not told.get("FENCE_ENABLE", radius):
        switch = "FENCE_ENABLE" if "FENCE_ENABLE" in told else "GF_MAX_HOR_DIST"
        cure = f"{switch} switches it on: it holds also where the ground fails"
        return Check("fence", False, "its own is off", cure, required=False)
    if not circle:
        return Check("fence", True, "its own is on, without a circle", required=False)
    text = f"its own is on, {radius:g} m around home"
    start, team = p.spec.start, p.scenario.team
    way = extremes(p.spec.path, p.spec, team)
    farthest = max(hypot(east - start.east, north - start.north) for east, north, _ in way)
    if farthest >= radius:
        text += f", and its path leads {farthest:.0f} m away"
        return Check("fence", False, text, "widen it, or shorten the path", required=False)
    return Check("fence", True, text, required=False)


def _ready(p: Preflight) -> Check:
    s = p.status
    if s.armed and p.spec.kind == "quadcopter" and not s.landed:
        cure = "have its pilot or a ground station land it: nobody takes over a vehicle in flight"
        return Check("ready", False, "armed already, and not known to stand", cure)
    if s.armed and hypot(*s.velocity) > STANDING:
        cure = "stop and disarm it first: nobody takes over a vehicle that is driven"
        return Check("ready", False, "armed already, and moving", cure)
    if s.armed:
        return Check("ready", True, "armed already, standing")
    if s.prearm_ok:
        return Check("ready", True, "says that it may arm")
    if s.sensors is None:
        return Check("ready", None, "its own checks are not told yet")
    if s.prearm_ok is None:
        return Check("ready", None, "does not tell: arming will show", required=False)
    said = _reasons(s)
    cure = "do what it says" if said else "wait; its messages say what it waits for"
    return Check("ready", False, f"says {', '.join(said)}" if said else "may not arm yet", cure)


def _reasons(s: VehicleStatus) -> list[str]:
    """Return why it would not arm: what it last said in one go."""
    refusals = [(at, text) for at, _, text in s.texts if text.startswith(_REFUSALS)]
    return list(dict.fromkeys(repr(t) for at, t in refusals if at > refusals[-1][0] - _AT_ONCE_S))


_AFTER_LINK = {
    "identity": _identity,
    "position": _position,
    "origin": _origin,
    "place": _place,
    "battery": _battery,
    "fence": _fence,
    "ready": _ready,
}
