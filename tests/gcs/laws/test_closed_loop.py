"""Under the safe law light vehicles (first order, lags as measured) arrive and never touch."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from math import atan2, cos, exp, hypot, inf, pi, sin, sqrt
from random import Random

import pytest

from mavherd.gcs.laws import Command, Nominal, Peer, make_law
from mavherd.transport.frames import Triple, wrap_angle

TICK = 0.05  # s, coordination
SUBSTEPS = 5
V_MAX = {"rover": 1.0, "quadcopter": 1.5}  # m/s
LAG = {"rover": 0.28, "quadcopter": 0.45}  # s, velocity
MASS = {"rover": 8.4, "quadcopter": 1.2}  # kg
RADIUS = {"rover": 0.395, "quadcopter": 0.2}  # m, contact circle
EXTENT = {"rover": (0.0, 0.9), "quadcopter": (-0.1, 0.1)}  # m, from its position upwards
ARRIVED = 0.2  # m

KINDS = pytest.mark.parametrize("kind", ["rover", "quadcopter"])
Route = Callable[[float], Nominal]


@dataclass(kw_only=True)
class Robot:
    """A rover drives along its heading; a quadcopter follows its velocity in each axis."""

    system_id: int
    kind: str
    position: Triple
    route: Route
    heading: float = 0.0
    vertical: bool = False
    inert: bool = False  # stands in the way and cannot do anything about it
    velocity: Triple = (0.0, 0.0, 0.0)
    arrived: float = inf  # s, when it came to its target to stay
    trail: list[Triple] = field(default_factory=list)  # one a tick

    def peer(self) -> Peer:
        return Peer(
            self.system_id,
            self.kind,
            self.position,
            self.velocity,
            self.heading,
            vertical=self.vertical,
        )

    def move(self, command: Command, gust: Triple, dt: float) -> None:
        want = command.velocity or (0.0, 0.0, 0.0)
        follow = 1 - exp(-dt / LAG[self.kind])
        if self.kind == "rover":
            along = (cos(self.heading), sin(self.heading))
            speed = self.velocity[0] * along[0] + self.velocity[1] * along[1]
            wanted = hypot(want[0], want[1])
            off = wrap_angle(atan2(want[1], want[0]) - self.heading) if wanted > 1e-3 else 0.0
            speed += (wanted * max(0.0, cos(off)) ** 2 - speed) * follow + gust[0] * dt
            self.heading += min(2.0, max(-2.0, 4 * off)) * dt
            self.velocity = (speed * cos(self.heading), speed * sin(self.heading), 0.0)
        else:
            self.velocity = triple(
                v + (w - v) * follow + a * dt
                for v, w, a in zip(self.velocity, want, gust, strict=True)
            )
        self.position = triple(
            p + v * dt for p, v in zip(self.position, self.velocity, strict=True)
        )

    def look(self, now: float) -> None:
        self.trail.append(self.position)
        self.arrived = min(self.arrived, now) if self.error(now, self.position) < ARRIVED else inf

    def error(self, now: float, position: Triple) -> float:
        target = self.route(now).position
        return hypot(target[0] - position[0], target[1] - position[1])

    def rmse(self, since: float = 5.0) -> float:
        errors = [self.error((i + 1) * TICK, p) for i, p in enumerate(self.trail)]
        late = errors[round(since / TICK) :]
        return sqrt(sum(e * e for e in late) / len(late))


@dataclass(frozen=True, kw_only=True)
class World:
    """What disturbs the robots and their radio."""

    seed: int = 1
    force: float = 0.0  # N, on each axis, held for 0.1 s
    delay: int = 0  # ticks
    loss: float = 0.0


CALM = World()


@dataclass
class Outcome:
    """What the judge saw."""

    nearest: float = inf  # m, centre to centre, of pairs that could touch
    gap: float = inf  # m, between contact circles
    arrival: float = 0.0  # s, of the last

    def judge(self, a: Robot, b: Robot) -> None:
        (low_a, high_a), (low_b, high_b) = EXTENT[a.kind], EXTENT[b.kind]
        up = a.position[2] - b.position[2]
        if up + low_a > high_b or up + high_a < low_b:
            return
        distance = hypot(a.position[0] - b.position[0], a.position[1] - b.position[1])
        self.nearest = min(self.nearest, distance)
        self.gap = min(self.gap, distance - RADIUS[a.kind] - RADIUS[b.kind])


def run(robots: Sequence[Robot], seconds: float, world: World = CALM) -> Outcome:
    random = Random(world.seed)
    laws = {r.system_id: make_law("safe", kind=r.kind, v_max=V_MAX[r.kind]) for r in robots}
    able = [r for r in robots if not r.inert]
    gusts = {r.system_id: (0.0, 0.0, 0.0) for r in robots}
    sent: list[list[Peer]] = []
    heard: dict[int, dict[int, tuple[Peer, int]]] = {r.system_id: {} for r in robots}
    outcome = Outcome()
    dt = TICK / SUBSTEPS
    for tick in range(round(seconds / TICK)):
        then = max(0, tick - world.delay)
        sent.append([r.peer() for r in robots])
        commands = {}
        for me in able:
            log = heard[me.system_id]
            for peer in sent[then]:
                if peer.system_id != me.system_id and random.random() >= world.loss:
                    log[peer.system_id] = peer, then
            others = [peer._replace(age=(tick - t) * TICK) for peer, t in log.values()]
            nominal = me.route(tick * TICK)
            commands[me.system_id] = laws[me.system_id](me.peer(), others, nominal)
        if world.force and tick % 2 == 0:
            for r in robots:
                f = world.force / MASS[r.kind]
                gusts[r.system_id] = triple(random.uniform(-f, f) for _ in range(3))
        for _ in range(SUBSTEPS):
            for me in able:
                me.move(commands[me.system_id], gusts[me.system_id], dt)
            for a, b in combinations(robots, 2):
                outcome.judge(a, b)
        for me in able:
            me.look((tick + 1) * TICK)
    outcome.arrival = max(r.arrived for r in able)
    return outcome


def triple(values: Iterable[float]) -> Triple:
    x, y, z = values
    return x, y, z


def to(east: float, north: float, up: float = 0.0) -> Route:
    return lambda now: Nominal((east, north, up), yaw=0.0)


def round_and_round(radius: float, start: float, rate: float, up: float = 0.0) -> Route:
    def route(now: float) -> Nominal:
        a = start + rate * now
        east, north = radius * cos(a), radius * sin(a)
        return Nominal((east, north, up), (-rate * north, rate * east, 0.0), 0.0)

    return route


def near(random: Random, east: float, north: float, up: float = 0.0) -> Triple:
    return random.gauss(east, 0.2), random.gauss(north, 0.2), up


def level(kind: str) -> float:
    return 0.0 if kind == "rover" else 3.0


def line_up(kind: str, seed: int) -> list[Robot]:
    """The mission of Fig. 5: one class drawn up in a line, to three targets on the same line."""
    random = Random(seed)
    first, ids = (0.0, (1, 2, 3)) if kind == "rover" else (-4.0, (4, 5, 6))
    z = level(kind)
    return [
        Robot(
            system_id=i,
            kind=kind,
            position=near(random, start, start, z),
            route=to(goal, goal, z),
            heading=pi / 4,
        )
        for i, start, goal in zip(
            ids, (first, first - 1.3, first - 2.6), (4.0, 7.0, 10.0), strict=True
        )
    ]


def swap(kind: str, n: int, radius: float, seed: int | None = None) -> list[Robot]:
    """Everybody on a circle, to the opposite point; exactly, unless a seed is given."""
    random, sigma = Random(seed), 0.0 if seed is None else 0.1
    z = level(kind)
    return [
        Robot(
            system_id=i + 1,
            kind=kind,
            position=(
                radius * cos(a) + random.gauss(0, sigma),
                radius * sin(a) + random.gauss(0, sigma),
                z,
            ),
            route=to(-radius * cos(a), -radius * sin(a), z),
            heading=a + pi,
        )
        for i, a in enumerate(2 * pi * i / n for i in range(n))
    ]


def face_to_face(kind: str, step: float = 0.0) -> list[Robot]:
    z = level(kind)
    return [
        Robot(system_id=1, kind=kind, position=(-4, 0, z), route=to(4, 0, z)),
        Robot(
            system_id=2, kind=kind, position=(4, 0, z + step), route=to(-4, 0, z + step), heading=pi
        ),
    ]


@KINDS
@pytest.mark.parametrize("seed", range(4))
def test_a_line_that_has_to_pass_itself_arrives_without_contact(kind, seed):
    # The quadcopters' target of 18 s holds for the way the rovers have: theirs is 5.7 m longer.
    longer = 0.0 if kind == "rover" else hypot(4, 4) / (0.9 * V_MAX[kind])
    outcome = run(line_up(kind, seed), 30, World(seed=seed, force=0.4))
    assert outcome.gap > 0
    assert outcome.arrival < 1.1 * (20 if kind == "rover" else 18) + longer


@pytest.mark.parametrize("seed", range(3))
def test_rovers_on_one_circle_in_opposite_directions_make_way_and_return(seed):
    random = Random(seed)
    rate = 0.5 / 3
    paths = [
        round_and_round(3, -pi / 2, rate),
        round_and_round(3, pi / 2, -rate),
        to(0, 0),
    ]
    starts = [(0, -3), (0, 3), (5, 1.8)]
    robots = [
        Robot(system_id=i, kind="rover", position=near(random, *start), route=route, heading=h)
        for i, start, route, h in zip((1, 2, 3), starts, paths, (0.0, 0.0, pi), strict=True)
    ]
    outcome = run(robots, 2 * pi / rate, World(seed=seed, force=0.4))
    assert outcome.nearest > 0.95
    assert max(r.rmse() for r in robots[:2]) < 0.22
    assert robots[2].arrived < 10


@pytest.mark.parametrize("seed", range(3))
def test_a_quadcopter_goes_round_two_that_hover_on_its_circle(seed):
    random = Random(seed)
    routes = [round_and_round(2, pi, 0.25, 2.0), to(2, 0, 2), to(0, 2, 2)]
    robots = [
        Robot(system_id=i, kind="quadcopter", position=near(random, *at, 2.0), route=route)
        for i, at, route in zip((4, 5, 6), [(-2, 0), (2, 0), (0, 2)], routes, strict=True)
    ]
    outcome = run(robots, 50, World(seed=seed, force=0.4))
    assert outcome.nearest > 0.9
    assert robots[0].rmse() < 0.5
    assert max(r.rmse() for r in robots[1:]) < 0.14


@KINDS
@pytest.mark.parametrize("n", [4, 5, 8, 12, 16])
@pytest.mark.parametrize("seed", [None, 1])
def test_robots_that_swap_across_a_circle_all_arrive(kind, n, seed):
    outcome = run(swap(kind, n, max(3.0, 0.27 * n), seed), 30)
    assert outcome.gap > 0
    assert outcome.arrival < 25


@KINDS
@pytest.mark.parametrize("delay", [4, 8])
def test_late_and_lost_states_cause_no_contact(kind, delay):
    outcome = run(swap(kind, 8, 4.0, seed=delay), 25, World(seed=delay, delay=delay, loss=0.2))
    assert outcome.gap > 0
    assert outcome.arrival < 25


@KINDS
def test_exactly_face_to_face_each_goes_round_on_its_right(kind):
    robots = face_to_face(kind)
    outcome = run(robots, 20)
    assert min(north for _, north, _ in robots[0].trail) < -0.3
    assert max(north for _, north, _ in robots[1].trail) > 0.3
    assert outcome.gap > 0.2
    assert outcome.arrival < 12


@pytest.mark.parametrize("step", [0.1, 0.3, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2])
def test_quadcopters_at_any_height_difference_pass(step):
    outcome = run(face_to_face("quadcopter", step), 20)
    assert outcome.gap > 0
    assert outcome.arrival < 12


@pytest.mark.parametrize("start", [4.2, 4.6, 5.0, 5.4])
def test_a_quadcopter_that_sinks_through_anothers_level_while_passing_does_not_touch(start):
    robots = face_to_face("quadcopter", start - 3.0)
    robots[1].route = to(-4, 0, 2.0)
    outcome = run(robots, 20)
    assert outcome.gap > 0
    assert outcome.arrival < 12


@KINDS
def test_an_obstacle_in_the_way_is_passed(kind):
    z = level(kind)
    one = Robot(system_id=1, kind=kind, position=(-4, 0, z), route=to(4, 0, z))
    parked = Robot(system_id=2, kind=kind, position=(0, 0, z), route=to(0, 0, z), inert=True)
    outcome = run([one, parked], 20)
    assert outcome.gap > 0.2
    assert outcome.arrival < 10


@pytest.mark.parametrize("wait", [0.0, 1.0, 2.0, 3.0, 4.0])
@pytest.mark.parametrize("climbs", [True, False])
def test_a_rover_makes_room_for_a_quadcopter_that_lands_or_takes_off(wait, climbs):
    def change(now: float) -> Nominal:
        moved = 0.7 * max(0.0, now - wait)
        up = min(3.0, 0.1 + moved) if climbs else max(0.1, 3.0 - moved)
        return Nominal((0.0, 0.0, up))

    rover = Robot(system_id=1, kind="rover", position=(-3, 0, 0), route=to(3, 0))
    quad = Robot(
        system_id=2,
        kind="quadcopter",
        position=(0, 0, 0.1 if climbs else 3.0),
        route=change,
        vertical=True,
    )
    outcome = run([rover, quad], 20)
    assert outcome.gap > 0
    assert rover.arrived < 12


def test_a_quadcopter_flying_low_and_rovers_make_room_for_one_another():
    quad = Robot(system_id=1, kind="quadcopter", position=(-4, 0, 0.7), route=to(4, 0, 0.7))
    rovers = [
        Robot(system_id=2, kind="rover", position=(4, 0, 0), route=to(-4, 0), heading=pi),
        Robot(system_id=3, kind="rover", position=(0, 4, 0), route=to(0, -4), heading=-pi / 2),
    ]
    outcome = run([quad, *rovers], 30)
    assert outcome.gap > 0
    assert outcome.arrival < 15


def test_a_quadcopter_in_flight_pays_no_heed_to_rovers():
    quad = Robot(system_id=1, kind="quadcopter", position=(-4, 0, 2.5), route=to(4, 0, 2.5))
    rover = Robot(system_id=2, kind="rover", position=(4, 0, 0), route=to(-4, 0), heading=pi)
    run([quad, rover], 15)
    assert max(abs(north) for r in (quad, rover) for _, north, _ in r.trail) < 1e-9


def test_a_rover_that_has_arrived_stands_still():
    rover = Robot(system_id=1, kind="rover", position=(-4, 0, 0), route=to(0, 0))
    run([rover], 15)
    assert hypot(*rover.velocity) < 1e-3
    assert rover.error(15, rover.position) < 0.06
    assert abs(rover.heading) < 1e-9
