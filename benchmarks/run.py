"""What mavherd costs: start-up and memory of a vehicle, speed and CPU of a lockstep run.

    python benchmarks/run.py            everything but late ticks: about two minutes
    python benchmarks/run.py --realtime and late ticks at 1x, 5x and free-running: five minutes

Machines differ and are noisy, so figures are medians beside a floor of their own: the same work
without the processes, the sockets and the bus.
"""

import argparse
import os
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mavherd.gcs.run.launcher import Run, RunOptions
from mavherd.gcs.run.ports import PortPlan
from mavherd.gcs.team.coordinator import Coordinator
from mavherd.scenarios.loader import load_scenario
from mavherd.scenarios.starts import draw_starts
from mavherd.transport.links import UdpIn
from mavherd.transport.mavlink import Codec, Message, mav
from mavherd.transport.watcher import Watcher
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.vehicle import Vehicle

SCENARIO = "crossing-targets"
TICK_US = 50_000
SETTLING_S = 3.0  # from the start of a vehicle until its CPU time is looked at
SILENCE_S = 5.0
HEARTBEAT = mav.MAVLink_heartbeat_message(
    mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, mav.MAV_STATE_ACTIVE, 3
)
NO_PORTS = PortPlan(gcs_udp=0, api_udp=0, tcp=0)


@contextmanager
def vehicle(kind: str, ports: list[UdpIn]) -> Iterator[subprocess.Popen[bytes]]:
    """Run a vehicle that sends to some ports; stop both."""
    targets = [text for p in ports for text in ("--udpout", f"127.0.0.1:{p.port}")]
    process = subprocess.Popen(
        [sys.executable, "-m", "mavherd", "vehicle", kind, "--tcp", "0", *targets],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    try:
        yield process
    finally:
        process.terminate()
        process.communicate()
        for port in ports:
            port.close()


def alive(process: subprocess.Popen[bytes], begun: float, heard: float) -> None:
    """Raise RuntimeError when a vehicle has ended or was silent for too long."""
    if (code := process.poll()) is not None:
        said = process.stderr.read().decode() if process.stderr else ""
        raise RuntimeError(f"the vehicle ended with exit code {code}: {said}")
    if time.perf_counter() - max(begun, heard) > SILENCE_S:
        raise RuntimeError(f"nothing was heard of the vehicle for {SILENCE_S:g} s")


def vehicle_start(kind: str) -> tuple[float, float]:
    """Return seconds from starting a vehicle process to its first HEARTBEAT, and its RSS in MB."""
    port = UdpIn("127.0.0.1", 0)
    watcher, codec = Watcher([port]), Codec(255, 190)
    begun = time.perf_counter()
    with vehicle(kind, [port]) as process:
        while True:
            watcher.wait(1.0)
            for _, data in port.receive():
                if any(m.get_type() == "HEARTBEAT" for m in codec.decode(data)):
                    return time.perf_counter() - begun, resident_mb(process.pid)
            alive(process, begun, 0.0)


def resident_mb(pid: int) -> float:
    """Return the resident memory of a process in MB."""
    if sys.platform == "linux":
        for line in Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith("VmRSS"):
                return int(line.split()[1]) / 1024
    kilobytes = subprocess.run(
        ["ps", "-o", "rss=", "-p", str(pid)], capture_output=True, text=True, check=True
    )
    return int(kilobytes.stdout) / 1024


def serving(kind: str, clients: int, seconds: float = 10.0) -> tuple[float, float]:
    """Return the CPU share of a vehicle at real time, and the messages a second each client gets.

    Each client is a ground station on a UDP socket of its own that sends heartbeats and gets
    every stream that flows unasked, as QGroundControl or MAVSDK do; the first has the vehicle
    armed, and a quadcopter hover. With none the vehicle stands, and one socket gets the
    heartbeats that nobody answers.
    """
    ports = [UdpIn("127.0.0.1", 0) for _ in range(max(clients, 1))]
    codecs = [Codec(255 - number, 190) for number in range(len(ports))]
    begun = heard = time.perf_counter()
    began = used = beat_at = 0.0
    messages, armed = 0, False
    watcher = Watcher(list(ports))
    with vehicle(kind, ports) as process:
        while True:
            watcher.wait(0.1)
            now = time.perf_counter()
            beat, beat_at = now >= beat_at, beat_at if now < beat_at else now + 1
            for codec, port in zip(codecs, ports, strict=True):
                for _, data in port.receive():
                    heard = now
                    for m in codec.decode(data, stream=False):
                        messages += 1
                        if m.get_type() == "HEARTBEAT":
                            armed = bool(m.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)
                if beat and clients:
                    first = port is ports[0] and not began
                    for link in port.links():
                        link.send(codec.encode([HEARTBEAT, *(starting(kind) if first else ())]))
            alive(process, begun, heard)
            if not began and now - begun > SETTLING_S:  # start-up is another row
                if armed != bool(clients):
                    raise RuntimeError("the vehicle is not armed as it should be")
                began, used, messages = now, process_cpu_seconds(process.pid), 0
            elif began and now - began > seconds:
                share = (process_cpu_seconds(process.pid) - used) / (now - began)
                return share, messages / (now - began) / len(ports)


def starting(kind: str) -> list[Message]:
    """Return the commands that arm a vehicle in GUIDED and, where it can, have it take off."""
    guided = {"quadcopter": 4, "rover": 15}[kind]
    return [
        mav.MAVLink_command_long_message(1, 1, command, 0, *params, *[0] * (7 - len(params)))
        for command, params in (
            (mav.MAV_CMD_DO_SET_MODE, (mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, guided)),
            (mav.MAV_CMD_COMPONENT_ARM_DISARM, (1,)),
            (mav.MAV_CMD_NAV_TAKEOFF, (0, 0, 0, 0, 0, 0, 5)),
        )
    ]


def process_cpu_seconds(pid: int) -> float:
    """Return the CPU seconds that a running process has used (Linux)."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def floors() -> dict[str, float]:
    """Return CPU seconds per simulated second of the parts of a run, in this one process."""
    scenario = load_scenario(SCENARIO)
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


def fly(**options: Any) -> tuple[dict[str, Any], float]:
    """Run the scenario through its processes; return report and CPU seconds of all of them."""
    before = cpu_seconds()
    with tempfile.TemporaryDirectory() as folder:
        settings = RunOptions(out=Path(folder), figures=False, ports=NO_PORTS, **options)
        report = Run(load_scenario(SCENARIO), settings).execute().report
    return report, cpu_seconds() - before


def cpu_seconds() -> float:
    """Return CPU seconds of this process and of its children that have ended."""
    usages = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def main() -> None:
    """Print every table."""
    parser = argparse.ArgumentParser(description="What mavherd costs.")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--realtime", action="store_true", help="late ticks too: five minutes")
    args = parser.parse_args()
    print(f"Python {platform.python_version()}, {platform.platform()}\n")

    print("| one vehicle by hand | first HEARTBEAT, s | resident, MB |\n| --- | --- | --- |")
    for kind in ("quadcopter", "rover"):
        starts = [vehicle_start(kind) for _ in range(args.repeats)]
        ready, memory = (statistics.median(column) for column in zip(*starts, strict=True))
        print(f"| {kind} | {ready:.2f} | {memory:.0f} |")

    print("\n| at real time | clients | messages/s for each | CPU of one core |")
    print("| --- | --- | --- | --- |")
    for kind in ("quadcopter", "rover"):
        for clients in (0, 4):
            share, rate = serving(kind, clients)
            print(f"| {kind} | {clients} | {rate:.0f} | {share:.1%} |")

    parts = [floors() for _ in range(args.repeats)]
    floor = {part: statistics.median(p[part] for p in parts) for part in parts[0]}
    total = sum(floor.values())
    print(f"\n| {SCENARIO}, all in one process | ms CPU per simulated s |\n| --- | --- |")
    for part, seconds in floor.items():
        print(f"| {part} | {seconds * 1e3:.1f} |")
    print(f"| together | {total * 1e3:.1f} |")

    print("\n| lockstep, max speed | times real time | CPU s per simulated s | CPU / floor |")
    print("| --- | --- | --- | --- |")
    for record in (False, True):
        runs = [fly(record=record) for _ in range(args.repeats)]
        factor = statistics.median(report["real_time_factor"] for report, _ in runs)
        cpu = statistics.median(used / report["duration_s"] for report, used in runs)
        text = "with recording" if record else "without recording"
        print(f"| {text} | {factor:.1f} | {cpu:.3f} | {cpu / total:.1f} |")

    if args.realtime:
        print("\n| paced | times real time | late ticks | of |\n| --- | --- | --- | --- |")
        for text, options in (
            ("lockstep, --speed 1", {"speed": 1.0}),
            ("lockstep, --speed 5", {"speed": 5.0}),
            ("--free-run", {"lockstep": False}),
        ):
            report, _ = fly(record=True, **options)
            late, ticks = report["late_ticks"], report["ticks"]
            factor = report["real_time_factor"]
            print(f"| {text} | {factor:.2f} | {late} ({late / ticks:.2%}) | {ticks} |")


if __name__ == "__main__":
    main()
