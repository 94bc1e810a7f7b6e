"""The floors: parts of a run in this one process, without processes, sockets and bus.

All figures are CPU seconds per simulated second.
"""

import time
from collections.abc import Callable

from mavherd.gcs.team.coordinator import Coordinator
from mavherd.scenarios.loader import load_scenario
from mavherd.scenarios.schema import Scenario
from mavherd.scenarios.starts import draw_starts
from mavherd.transport.mavlink import Codec, Message, mav
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.vehicle import Vehicle

TICK_US = 50_000
GUIDED = {"quadcopter": 4, "rover": 15}
TAKEOFF_UP = 5.0  # m


def starting(kind: str, system_id: int = 1) -> list[Message]:
    """Return the commands that arm a vehicle in GUIDED and, where it can, have it take off."""
    return [
        mav.MAVLink_command_long_message(
            system_id, 1, command, 0, *params, *[0] * (7 - len(params))
        )
        for command, params in (
            (mav.MAV_CMD_DO_SET_MODE, (mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, GUIDED[kind])),
            (mav.MAV_CMD_COMPONENT_ARM_DISARM, (1,)),
            (mav.MAV_CMD_NAV_TAKEOFF, (0, 0, 0, 0, 0, 0, TAKEOFF_UP)),
        )
    ]


def under_way(kind: str) -> Vehicle:
    """Return a vehicle that hovers, or a rover that stands armed in GUIDED."""
    vehicle = Vehicle(VehicleConfig(kind=kind, system_id=1))
    link = vehicle.converse(channel=None)
    ground = Codec(255, 190)
    for _ in range(200):
        vehicle.step()
        vehicle.report(link, vehicle.take_broadcasts())
    vehicle.handle(ground.encode(starting(kind)), link)
    for _ in range(1000):
        vehicle.step()
        vehicle.report(link, vehicle.take_broadcasts())
    if not vehicle.autopilot.armed or (kind == "quadcopter" and vehicle.robot.on_ground):
        raise RuntimeError(f"the {kind} is not under way")
    return vehicle


def kernel(kind: str, seconds: float = 20.0) -> dict[str, float]:
    """Return the costs of physics alone, control alone, and a vehicle's step with its autopilot."""
    vehicle = under_way(kind)
    robot, setpoint = vehicle.robot, vehicle.autopilot.setpoint
    steps = round(seconds / robot.dt)
    step = _spent(vehicle.step, round(seconds / 0.01))
    control = _spent(lambda: robot.control(setpoint), steps // robot.control_every)
    physics = _spent(robot.advance, steps)
    return {
        "physics": physics / seconds,
        "control": control / seconds,
        "step": step / seconds,
    }


def _spent(what: Callable[[], object], times: int) -> float:
    begun = time.process_time()
    for _ in range(times):
        what()
    return time.process_time() - begun


def floors(scenario: Scenario | None = None) -> dict[str, float]:
    """Return the costs of the parts of a run: vehicles' physics, their MAVLink, coordination."""
    scenario = scenario or load_scenario("crossing-targets")
    vehicles = {
        spec.name: Vehicle(
            VehicleConfig(
                kind=spec.kind,
                system_id=spec.system_id,
                name=spec.name,
                north=spec.start.north,
                east=spec.start.east,
                params={"GUID_TIMEOUT": 0.5},
                latch_position=False,
            )
        )
        for spec in draw_starts(scenario)
    }
    links = {name: vehicle.converse(channel=None) for name, vehicle in vehicles.items()}
    coordinator = Coordinator(scenario, tuple(vehicles))
    inbox = dict.fromkeys(vehicles, b"")
    spent = {"physics and control": 0.0, "vehicle MAVLink": 0.0, "coordination": 0.0}
    now_us = 0
    clock = time.process_time
    while not coordinator.finished:
        now_us += TICK_US
        outbox = {}
        for name, vehicle in vehicles.items():
            begun = clock()
            out = vehicle.handle(inbox[name], links[name])
            spent["vehicle MAVLink"] += clock() - begun
            while vehicle.now_us < now_us:
                begun = clock()
                vehicle.step()
                stepped = clock()
                out += vehicle.report(links[name], vehicle.take_broadcasts())
                spent["physics and control"] += stepped - begun
                spent["vehicle MAVLink"] += clock() - stepped
            outbox[name] = out
        begun = clock()
        for name, out in outbox.items():
            coordinator.receive(name, out, now_us * 1e-6)
        inbox = coordinator.tick(now_us * 1e-6, coordinator.states())
        coordinator.take_events()
        spent["coordination"] += clock() - begun
    return {part: seconds / (now_us * 1e-6) for part, seconds in spent.items()}
