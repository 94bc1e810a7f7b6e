"""What mavherd costs: start-up and memory of a vehicle, speed and CPU of a lockstep run.

    python benchmarks/run.py            everything but real time: about a minute
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
from pathlib import Path
from typing import Any

from mavherd.gcs.coordinator import Coordinator
from mavherd.gcs.launcher import Run, RunOptions
from mavherd.gcs.ports import PortPlan
from mavherd.scenarios.loader import load_scenario
from mavherd.scenarios.starts import draw_starts
from mavherd.transport.links import UdpIn
from mavherd.transport.mavlink import Codec, mav
from mavherd.transport.watcher import Watcher
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.vehicle import Vehicle

SCENARIO = "crossing-targets"
TICK_US = 50_000
NO_PORTS = PortPlan(gcs_udp=0, api_udp=0, tcp=0)


def vehicle_start(kind: str) -> tuple[float, float]:
    """Return seconds from starting a vehicle process to its first HEARTBEAT, and its RSS in MB."""
    port = UdpIn("127.0.0.1", 0)
    watcher, codec = Watcher([port]), Codec(255, 190)
    command = [sys.executable, "-m", "mavherd", "vehicle", kind, "--tcp", "0"]
    begun = time.perf_counter()
    process = subprocess.Popen(
        [*command, "--udpout", f"127.0.0.1:{port.port}"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        while True:
            watcher.wait(1.0)
            for _, data in port.receive():
                if any(m.get_type() == "HEARTBEAT" for m in codec.decode(data)):
                    return time.perf_counter() - begun, resident_mb(process.pid)
    finally:
        process.terminate()
        process.wait()
        port.close()


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


def serving(kind: str, clients: int, seconds: float = 10.0) -> float:
    """Return the CPU share of a vehicle process at real time with so many clients attached.

    Each client is a ground station on a UDP socket of its own that sends heartbeats and gets
    every stream that flows unasked, as QGroundControl or MAVSDK do.
    """
    ports = [UdpIn("127.0.0.1", 0) for _ in range(max(clients, 1))]
    targets = [text for p in ports for text in ("--udpout", f"127.0.0.1:{p.port}")]
    codecs = [Codec(255 - number, 190) for number in range(clients)]
    heartbeat = mav.MAVLink_heartbeat_message(
        mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, mav.MAV_STATE_ACTIVE, 3
    )
    process = subprocess.Popen(
        [sys.executable, "-m", "mavherd", "vehicle", kind, "--tcp", "0", *targets],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        watcher, begun, used, beat_at = Watcher(ports), 0.0, 0.0, 0.0
        while True:
            watcher.wait(0.1)
            now = time.perf_counter()
            beat, beat_at = now >= beat_at, beat_at if now < beat_at else now + 1
            for number, port in enumerate(ports):
                for _ in port.receive():
                    begun = begun or now
                if beat and number < clients:
                    for link in port.links():
                        link.send(codecs[number].encode([heartbeat]))
            if begun and not used and now - begun > 2.0:  # start-up is another row
                begun, used = now, process_cpu_seconds(process.pid)
            elif used and now - begun > seconds:
                return (process_cpu_seconds(process.pid) - used) / (now - begun)
    finally:
        process.terminate()
        process.wait()
        for port in ports:
            port.close()


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
    links = {name: vehicle.converse() for name, vehicle in vehicles.items()}
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

    print("\n| at real time | CPU, no client | CPU, four clients | with / without |")
    print("| --- | --- | --- | --- |")
    for kind in ("quadcopter", "rover"):
        alone, four = (
            statistics.median(serving(kind, clients) for _ in range(args.repeats))
            for clients in (0, 4)
        )
        print(f"| {kind} | {alone:.1%} | {four:.1%} | {four / alone:.2f} |")

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
