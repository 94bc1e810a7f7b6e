"""A fleet on a desk: scripts, coordinator and vehicles in one process, without I/O or clock."""

from collections.abc import Callable
from contextlib import nullcontext
from math import pi

import pytest

from mavherd.gcs.script.fleet import Fleet
from mavherd.gcs.script.scripted import Scripted
from mavherd.gcs.script.values import Event
from mavherd.gcs.team.coordinator import Coordinator
from mavherd.scenarios.schema import Fence, Point, RobotSpec, Scenario, Team
from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.vehicle import Vehicle

TICK_S = 0.05


class Desk:
    """Stands in for the stage of a fleet; time passes when the script waits, as in lockstep."""

    def __init__(self, robots: tuple[RobotSpec, ...], law: str, fence: Fence | None) -> None:
        scenario = Scenario(name="desk", robots=robots, team=Team(law=law), fence=fence)
        names = tuple(spec.name for spec in robots)
        self.core = Coordinator(scenario, names, conduct=Scripted, strict=False)
        self.vehicles = {spec.name: Vehicle(_config(spec)) for spec in robots}
        self.links = {name: vehicle.converse() for name, vehicle in self.vehicles.items()}
        self.silent: set[str] = set()  # whose links are down
        self.sent = {name: [] for name in names}  # every message to a vehicle, and when
        self.at: dict[float, Callable[[], object]] = {}  # what else happens, and when
        self.now = 0.0
        self.pace = self
        self.lock = nullcontext()
        self.events: list[Event] = []
        self._to = dict.fromkeys(names, b"")

    def open(self) -> dict:
        for _ in range(4):
            self.step()
        return {name: (m, m.mission) for name, m in self.core.members.items()}

    def step(self) -> None:
        for due in [at for at in self.at if at <= self.now]:
            self.at.pop(due)()
        self.now = round(self.now + TICK_S, 6)
        for name, vehicle in self.vehicles.items():
            link = self.links[name]
            data = vehicle.handle(self._to[name], link)
            for _ in range(5):
                vehicle.step()
                data += vehicle.report(link, vehicle.take_broadcasts())
            if name not in self.silent:
                self.core.receive(name, data, self.now)
        for name, data in self.core.tick(self.now, self.core.states()).items():
            self._to[name] = b"" if name in self.silent else data
            self.sent[name] += [(self.now, m) for m in Codec(9).decode(self._to[name])]
        for event in self.core.take_events():
            self.events.append(Event(event["t"], event["vehicle"], event["kind"], event["text"]))

    def close(self, at_end: str, error: BaseException | None) -> None:
        """A desk has nobody to bring to rest."""

    def pilot(self, name: str, command: int, *params: float) -> None:
        """Have somebody else command a vehicle, from a link of his own."""
        vehicle = self.vehicles[name]
        filled = params + (0.0,) * (7 - len(params))
        message = mav.MAVLink_command_long_message(vehicle.config.system_id, 1, command, 0, *filled)
        vehicle.handle(Codec(255, 190).encode([message]), vehicle.converse())


def _config(spec: RobotSpec) -> VehicleConfig:
    return VehicleConfig(
        kind=spec.kind,
        system_id=spec.system_id,
        name=spec.name,
        north=spec.start.north,
        east=spec.start.east,
        yaw=pi / 2 - spec.heading,
        params=spec.params,
        autopilot=spec.autopilot,
    )


@pytest.fixture
def desk_of():
    """Return an open fleet and its desk: desk_of("quad1", "rover1", autopilot="px4")."""

    def make(
        *names: str, autopilot: str = "ardupilot", law: str = "safe", fence: Fence | None = None
    ) -> tuple[Fleet, Desk]:
        robots = tuple(
            RobotSpec(
                name=name,
                kind="quadcopter" if name.startswith("quad") else "rover",
                system_id=number,
                start=Point(3.0 * number - 3.0, 0.0),
                autopilot=autopilot,
            )
            for number, name in enumerate(names, 1)
        )
        desk = Desk(robots, law, fence)
        return Fleet(desk, "land").open(), desk

    return make
