"""What a tick of the coordinator costs: N robots in a field, from their bytes to their setpoints.

    python benchmarks/coordinator_tick.py               all rows, less than a minute
    python benchmarks/coordinator_tick.py --law paper --area 36 --teams 64 240

The robots are points that do at once what they are told, so that nothing but the coordinator costs;
what they say goes through the codec, as from vehicles. Of each part the median over the ticks is
given, of CPU time, in ms.
"""

import argparse
import gc
import platform
import statistics
import time
from collections.abc import Iterable
from itertools import pairwise
from math import inf
from random import Random
from typing import Any, NamedTuple

from mavherd.gcs.team.coordinator import Coordinator
from mavherd.gcs.team.exchange import Exchange
from mavherd.scenarios.schema import Circle, Point, RobotSpec, Scenario, Team
from mavherd.transport.child import GC_THRESHOLD
from mavherd.transport.mavlink import Codec, Message, mav
from mavherd.transport.wire import Phase

TEAMS = (4, 16, 64, 128, 240)
AREAS = (9.0, 36.0)  # m^2 of the field for each robot
PERIOD_S = 0.05
SETTLING = 40  # ticks until all move
TICKS = 100
UP = 2.0  # m, of quadcopters
GUIDED = {"quadcopter": 4, "rover": 15}
TYPES = {"quadcopter": mav.MAV_TYPE_QUADROTOR, "rover": mav.MAV_TYPE_GROUND_ROVER}


class Puppet:
    """A point that says it is armed in GUIDED and moves as the last setpoint says. NED."""

    def __init__(self, spec: RobotSpec) -> None:
        self.place = [spec.start.north, spec.start.east, -UP if spec.kind == "quadcopter" else 0.0]
        self.velocity = [0.0, 0.0, 0.0]
        self._kind = spec.kind
        self._codec = Codec(spec.system_id)
        self._ticks = spec.system_id  # they do not all speak of the same in the same tick

    def speak(self, heard: bytes, now: float) -> bytes:
        """Move for one period, and return what a vehicle would have said meanwhile."""
        said: list[Message] = []
        for m in self._codec.decode(heard, stream=False):
            if m.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
                self.velocity = [m.vx, m.vy, m.vz if self._kind == "quadcopter" else 0.0]
            elif m.get_type() == "COMMAND_LONG":
                said.append(mav.MAVLink_command_ack_message(m.command, 0, 0, 0, 254, 190))
        self.place = [x + v * PERIOD_S for x, v in zip(self.place, self.velocity, strict=True)]
        boot_ms = round(now * 1000)
        self._ticks += 1
        if self._ticks % 20 == 0 or boot_ms <= PERIOD_S * 1000:
            mode, armed = GUIDED[self._kind], mav.MAV_MODE_FLAG_SAFETY_ARMED
            said.append(mav.MAVLink_heartbeat_message(TYPES[self._kind], 3, armed | 1, mode, 4, 3))
        pose = (*self.place, *self.velocity)
        said.append(mav.MAVLink_local_position_ned_message(boot_ms, *pose))
        if self._ticks % 2 == 0:
            said.append(mav.MAVLink_attitude_message(boot_ms, 0.01, 0.02, 0.5, 0.0, 0.0, 0.0))
        return self._codec.encode(said)


class Deaf:
    """A bus where somebody listens to the team, and nobody to single vehicles."""

    wanted = False

    def publisher(self, key: str, **_: Any) -> "Deaf":
        """Return what takes samples on `key`."""
        heard = Deaf()
        heard.wanted = key == "team"
        return heard

    def declare_token(self, key: str) -> "Deaf":
        """Return what could be undeclared."""
        return self

    def put(self, payload: bytes) -> None:
        """Do nothing."""


class Cost(NamedTuple):
    """Milliseconds of CPU time of one tick."""

    decode: float
    share: float
    decide: float
    encode: float

    @property
    def whole(self) -> float:
        """All of it."""
        return sum(self)


def field(robots: int, area: float, law: str, seed: int = 1) -> Scenario:
    """Return as many rovers as quadcopters in a square, each on a circle of its own."""
    random = Random(seed)
    side = (robots * area) ** 0.5
    apart = 0.9  # m between two starts; dense fields are drawn until they are
    starts: list[Point] = []
    while len(starts) < robots:
        place = Point(random.uniform(0, side), random.uniform(0, side))
        if all((place.east - p.east) ** 2 + (place.north - p.north) ** 2 > apart for p in starts):
            starts.append(place)
    specs = []
    for number, start in enumerate(starts, 1):
        kind = ("quadcopter", "rover")[number % 2]
        radius = random.uniform(1, 3)
        circle = Circle(centre=start, radius=radius, clockwise=number % 3 == 0, laps=99)
        specs.append(
            RobotSpec(
                name=f"{kind}{number}",
                kind=kind,
                system_id=number,
                start=start,
                path=circle,
            )
        )
    team = Team(law=law, takeoff_up=UP, start_sigma_m=0.0)
    return Scenario(name="field", robots=tuple(specs), team=team)


def ticks(scenario: Scenario, *, index_from: float | None = None) -> Iterable[Cost]:
    """Yield what each tick costs, once all robots move; `index_from`: see `Coordinator`."""
    options: dict[str, Any] = {} if index_from is None else {"index_from": index_from}
    core = Coordinator(scenario, tuple(s.name for s in scenario.robots), **options)
    exchange = Exchange(core, Deaf(), lockstep=True)  # type: ignore[arg-type]  # it is as good
    puppets = {spec.name: Puppet(spec) for spec in scenario.robots}
    sent = dict.fromkeys(puppets, b"")
    gc.freeze()  # as coordinators do
    gc.set_threshold(GC_THRESHOLD)
    clock = time.process_time
    for number in range(1, SETTLING + TICKS + 1):
        now = number * PERIOD_S
        said = {name: puppet.speak(sent[name], now) for name, puppet in puppets.items()}
        begun = clock()
        for name, data in said.items():
            core.receive(name, data, now)
        decoded = clock()
        exchange.offer(now)
        states = exchange.gather(now)
        shared = clock()
        core.decide(now, states)
        decided = clock()
        sent = core.transmit(now)
        exchange.publish_targets()
        encoded = clock()
        core.take_events()
        if number > SETTLING:
            moments = (begun, decoded, shared, decided, encoded)
            yield Cost(*((b - a) * 1e3 for a, b in pairwise(moments)))
    if any(member.mission.phase is not Phase.ACTIVE for member in core.members.values()):
        raise RuntimeError("not all robots are on their circles")


def tick_cost(
    robots: int, area: float = 9.0, law: str = "safe", *, index_from: float | None = None
) -> Cost:
    """Return the median of each part of a tick."""
    costs = ticks(field(robots, area, law), index_from=index_from)
    return Cost(*(statistics.median(part) for part in zip(*costs, strict=True)))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="What a tick of the coordinator costs.")
    parser.add_argument("--law", default="safe")
    parser.add_argument("--teams", type=int, nargs="+", default=TEAMS)
    parser.add_argument("--area", type=float, nargs="+", default=AREAS, help="m^2 for each robot")
    args = parser.parse_args()
    print(f"Python {platform.python_version()}, law {args.law}, ms of CPU time for a tick\n")
    print("| robots | m^2 each | index | decode | share | decide | encode | whole |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for area in args.area:
        for robots in args.teams:
            for text, index_from in (("no", inf), ("yes", 0)):
                cost = tick_cost(robots, area, args.law, index_from=index_from)
                parts = " | ".join(f"{ms:.3f}" for ms in (*cost, cost.whole))
                print(f"| {robots} | {area:g} | {text} | {parts} |")


if __name__ == "__main__":
    main()
