"""Runs a scenario: starts every process, conducts the clock, ends everything, writes the report."""

import json
import platform
import secrets
import signal
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from importlib.util import find_spec
from math import pi
from pathlib import Path
from types import FrameType
from typing import Any, Protocol

from .. import __version__
from ..scenarios.dump import scenario_to_yaml
from ..scenarios.schema import RobotSpec, Scenario
from ..scenarios.starts import draw_starts
from ..transport.bus import Bus, Mailbox
from ..transport.channel import Channel, ChannelClosed
from ..transport.errors import LinkError, VehicleError
from ..transport.links import patience, socket_pair_udp
from ..transport.tlog import digest
from ..transport.wire import Phase, VehicleState, unpack_team
from ..vehicles.config import VehicleConfig
from ..vehicles.process import DONE, LIVENESS_S
from .children import READY_S, Child, Nursery, Recorder, how_it_ended
from .conductor import (
    Clock,
    CoordinatorHandle,
    Died,
    FreeRun,
    Interrupted,
    Lockstep,
    Pacer,
    VehicleHandle,
)
from .coordinator import check_laws
from .judge import judge
from .ports import LOOPBACK, PortPlan, free_tcp_port
from .recorder import write_robots
from .report import RunFacts, build_report, write_report
from .truth import TruthError, read_truth

PASSED, FAILED, TIMED_OUT, INTERRUPTED = 0, 1, 4, 130
_VIEW_PERIOD_S = 0.1
_RECORDER_END_S = 20.0
_END_S = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """How to run a scenario, apart from what it says itself."""

    lockstep: bool = True
    speed: float | None = None  # times real time; None: as fast as it goes (lockstep)
    record: bool = True
    figures: bool = True
    out: Path = Path("runs")
    ports: PortPlan = PortPlan()


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a run."""

    exit_code: int
    folder: Path
    report: dict[str, Any]
    notes: list[str]  # for the user: what is missing and what to install


class View(Protocol):
    """Shows a run while it goes on."""

    def started(self, folder: Path, ports: dict[str, Any]) -> None:
        """Everything is up; the run begins."""
        ...

    def update(self, now: float, states: list[VehicleState], factor: float) -> None:
        """Show the team at fleet time `now`, running `factor` times as fast as real time."""
        ...

    def event(self, event: dict[str, Any]) -> None:
        """Show one event."""
        ...


@dataclass(slots=True)
class _Result:
    """How the clock's part of a run ended."""

    error: str | None = None
    exit_code: int = PASSED


class Run:
    """One run of one scenario: its folder, processes and clock."""

    def __init__(self, scenario: Scenario, options: RunOptions, view: View) -> None:
        check_laws(scenario)
        self.scenario = scenario
        self.options = options
        self.starts = draw_starts(scenario)
        stamp = time.strftime("%Y%m%d-%H%M%S")
        self.run_id = f"{scenario.name}-{stamp}-{secrets.token_hex(2)}"
        self.folder = options.out / self.run_id
        self.ready_at: float | None = None
        self.ports: dict[str, Any] = {}
        self._view = view
        self._signals = 0
        self._partial = False
        self._vehicles: list[VehicleHandle] = []
        self._coordinators: list[CoordinatorHandle] = []
        self._children: list[Child] = []
        self._phases: dict[str, str] = {}
        self._wall_s = 0.0

    def execute(self) -> Outcome:
        """Run from start to report. Raises MavherdError when nothing could be started."""
        with self._interruptible(), ExitStack() as stack:
            self._make_folder()
            log = stack.enter_context((self.folder / "events.jsonl").open("w", buffering=1))
            bus = stack.enter_context(self._open_bus())
            events = bus.publisher("events")

            def on_event(event: dict[str, Any]) -> None:
                line = json.dumps(event)
                log.write(line + "\n")
                events.put(line.encode())
                self._note_phase(event)
                self._view.event(event)

            recorder = self._start_recorder()
            nursery = Nursery(self.folder / "launcher.txt")
            clock: Clock | None = None
            result = _Result()
            try:
                # Free-running, all begin at one moment that nobody has reached yet.
                started = time.monotonic() + 0.1 + 0.005 * len(self.starts)
                coordinator_sockets = self._start_vehicles(nursery, started)
                self._start_coordinators(coordinator_sockets, started)
                self._wait_ready(recorder)
                kind = Lockstep if self.options.lockstep else FreeRun
                clock = kind(self._vehicles, self._coordinators, self._interrupted, on_event)
                self._view.started(self.folder, self.ports)
                self._conduct(clock, bus, started)
                result.exit_code = PASSED if clock.finished else TIMED_OUT
            except Interrupted:
                result = _Result("interrupted", INTERRUPTED)
            except Died as died:
                result = _Result(self._obituary(died, nursery), VehicleError.exit_code)
            except (VehicleError, OSError) as error:  # OSError: the disk is full, say
                result = _Result(str(error), VehicleError.exit_code)
            finally:
                self._stop(nursery, hurry=result.error is not None)
                if recorder and not recorder.close(_RECORDER_END_S, self._interrupted):
                    self._partial = True
            if self._interrupted() and result.error is None:
                result = _Result("interrupted", INTERRUPTED)
            try:
                outcome = self._report(clock, result)
            except OSError as error:
                first = f"{result.error}; " if result.error else ""
                raise VehicleError(
                    f"{first}{self.folder}: cannot write the report: {error.strerror or error}"
                ) from None
            if self._interrupted() and result.error is None:
                raise KeyboardInterrupt  # while the report was written: it is complete
            return outcome

    # Start

    def _make_folder(self) -> None:
        try:
            for spec in self.starts:
                (self.folder / "vehicles" / spec.name).mkdir(parents=True)
            text = scenario_to_yaml(self.scenario)
            (self.folder / "scenario.yaml").write_text(text, encoding="utf-8")
            write_robots(self.folder, self.starts, self.scenario.team)
        except OSError as error:
            raise LinkError(
                f"{self.folder}: cannot write the run folder: {error.strerror}"
            ) from None

    def _open_bus(self) -> Bus:
        for attempt in range(5):
            self.endpoint = f"tcp/{LOOPBACK}:{free_tcp_port()}"
            try:
                return Bus.router(self.endpoint, self.run_id, reliable=self.options.lockstep)
            except LinkError:
                if attempt == 4:
                    raise
        raise AssertionError("unreachable")

    def _start_recorder(self) -> Recorder | None:
        if not self.options.record or find_spec("rerun") is None:
            return None
        return Recorder(self.folder, self.endpoint, self.run_id)

    def _start_vehicles(self, nursery: Nursery, started: float) -> dict[str, socket.socket]:
        """Start every vehicle; return the coordinator's end of each one's socket."""
        ends = {}
        for spec in self.starts:
            config = self._config(spec)
            ours, theirs = socket_pair_udp()
            control, its_control = socket.socketpair()
            instance = spec.system_id - 1
            tcp = self.options.ports.listen(instance)
            udp = self.options.ports.udp_targets(instance)
            self.ports[spec.name] = {
                "system_id": spec.system_id,
                "udp": [f"{host}:{port}" for host, port in udp],
                "tcp": f"{LOOPBACK}:{tcp.getsockname()[1]}" if tcp else None,
            }
            request = {
                "config": config.to_json(),
                "folder": str((self.folder / "vehicles" / spec.name).absolute()),
                "udpout": udp,
                "lockstep": self.options.lockstep,
                "started": started,
            }
            passed = [theirs, its_control, *([tcp] if tcp else [])]
            pid = nursery.spawn(request, passed, self._interrupted)
            for sock in passed:
                sock.close()
            self._vehicles.append(VehicleHandle(spec.name, pid, control))
            ends[spec.name] = ours
        self.ports["zenoh"] = self.endpoint
        text = json.dumps(self.ports, indent=1)
        (self.folder / "ports.json").write_text(text + "\n", encoding="utf-8")
        return ends

    def _config(self, spec: RobotSpec) -> VehicleConfig:
        team = self.scenario.team
        return VehicleConfig(
            kind=spec.kind,
            system_id=spec.system_id,
            name=spec.name,
            origin=self.scenario.origin,
            north=spec.start.north,
            east=spec.start.east,
            down=-(spec.start.up or 0.0),
            yaw=pi / 2 - spec.heading,
            profile=spec.profile,
            params=spec.params,
            disturbance=spec.disturbance or self.scenario.disturbance,
            seed=self.scenario.seed,
            setpoint_timeout=team.setpoint_timeout_s,
            latch_position=False,
        )

    def _start_coordinators(self, ends: dict[str, socket.socket], started: float) -> None:
        names = [spec.name for spec in self.starts]
        together = self.scenario.team.coordinators == "central"
        by_name = {vehicle.name: vehicle for vehicle in self._vehicles}
        for own in [names] if together else [[name] for name in names]:
            ours, theirs = socket.socketpair()
            fds = [theirs.fileno(), *(ends[name].fileno() for name in own)]
            self._children.append(
                Child(
                    "mavherd.gcs.coordinator_process",
                    [str(theirs.fileno())],
                    log=self.folder / "launcher.txt",
                    fds=fds,
                )
            )
            theirs.close()
            name = "the coordinator" if together else f"the coordinator of {own[0]}"
            handle = CoordinatorHandle(name, Channel(ours), [by_name[n] for n in own])
            job = {
                "folder": str(self.folder.absolute()),
                "run_id": self.run_id,
                "endpoint": self.endpoint,
                "own": {n: ends[n].fileno() for n in own},
                "lockstep": self.options.lockstep,
                "started": started,
            }
            with suppress(ChannelClosed):  # it is dead already: noticed when it is not ready
                handle.channel.send(job)
            self._coordinators.append(handle)
        for sock in ends.values():
            sock.close()

    def _wait_ready(self, recorder: Recorder | None) -> None:
        allowed = READY_S + 0.5 * len(self._coordinators)
        deadline = time.monotonic() + allowed
        for coordinator in self._coordinators:
            answer = None
            while answer is None:
                if self._interrupted():
                    raise Interrupted
                if time.monotonic() > deadline:
                    raise VehicleError(f"{coordinator.name} did not start in {allowed:.0f} s")
                try:
                    answer = coordinator.channel.receive(0.1)
                except ChannelClosed:
                    raise VehicleError(
                        f"{coordinator.name} could not start; see {self.folder}/launcher.txt"
                    ) from None
            if error := answer.get("error"):
                raise VehicleError(error)
        while recorder and not recorder.wait_ready(0.1):
            if self._interrupted():
                raise Interrupted
            if recorder.ended or time.monotonic() > deadline:
                self._partial = True
                return

    # Run

    def _conduct(self, clock: Clock, bus: Bus, started: float) -> None:
        scenario, speed = self.scenario, self.options.speed
        period = 1.0 / scenario.team.rate_hz
        team, ticks = bus.latest("team"), bus.publisher("clock")
        begun = time.monotonic()
        shown = begun
        pacer = Pacer(speed, period) if speed and isinstance(clock, Lockstep) else None
        try:
            while not clock.finished and clock.now < scenario.duration - 1e-9:
                if self._interrupted():
                    raise Interrupted
                if isinstance(clock, Lockstep):
                    clock.tick(round(period * 1e6))
                    ticks.put(f"{clock.now:.6f}".encode())
                elif isinstance(clock, FreeRun):
                    clock.listen(started, _VIEW_PERIOD_S)
                wall = time.monotonic()
                if wall - shown > _VIEW_PERIOD_S:
                    shown = wall
                    self._view.update(clock.now, _latest_team(team), clock.now / (wall - begun))
                if pacer:
                    pacer.wait()
        finally:
            self._wall_s = time.monotonic() - begun
            if pacer:
                clock.late = pacer.late

    def _note_phase(self, event: dict[str, Any]) -> None:
        if event["kind"] == "phase" and self.ready_at is None:
            self._phases[event["vehicle"]] = event["text"]
            active = Phase.ACTIVE.name.lower()
            if list(self._phases.values()).count(active) == len(self.starts):
                self.ready_at = event["t"]

    # End

    def _stop(self, nursery: Nursery, *, hurry: bool) -> None:
        """End every process, coordinators first; nothing is left afterwards.

        Only a frozen process makes us wait, in a `hurry` not for long.
        """
        deadline = time.monotonic() + (_END_S if hurry else LIVENESS_S)
        for coordinator in self._coordinators:
            _half_close(coordinator.channel.socket)
        for coordinator in self._coordinators:
            try:
                while (last := coordinator.channel.receive(_left(deadline))) is not None:
                    coordinator.late = last.get("late", coordinator.late)
                    coordinator.ticks = last.get("ticks", coordinator.ticks)
            except ChannelClosed:
                pass
            coordinator.channel.close()
        for child in self._children:
            child.end(_left(deadline))
        for vehicle in self._vehicles:
            _half_close(vehicle.control)
        deadline = time.monotonic() + (_END_S / 4 if hurry else LIVENESS_S)
        for vehicle in self._vehicles:
            patience(vehicle.control, _left(deadline))
            try:
                while len(data := vehicle.control.recv(4096)) >= DONE.size:
                    _, vehicle.ticks, vehicle.outside_clients, vehicle.late = DONE.unpack(
                        data[-DONE.size :]
                    )
            except OSError:
                pass
            vehicle.control.close()
        nursery.close()

    def _obituary(self, died: Died, nursery: Nursery) -> str:
        if died.pid is None:
            at = [c.name for c in self._coordinators].index(died.name)
            who, code = died.name, self._children[at].wait(1.0)
            log = self.folder / "launcher.txt"
        else:
            who, code = f"{died.name} (pid {died.pid})", nursery.exit_code(died.pid)
            log = self.folder / "vehicles" / died.name / "log.txt"
        hint = f"; see {log}" if log.exists() and log.stat().st_size else ""
        return f"{who} {how_it_ended(code)} at {died.now:.2f} s{hint}"

    def _report(self, clock: Clock | None, result: _Result) -> Outcome:
        now = clock.now if clock else 0.0
        tracks, missing = [], False
        for spec in self.starts:
            base = self.folder / "vehicles" / spec.name / "truth.bin"
            part = base.with_name("truth.bin.part")
            path = base if base.exists() else part
            missing = missing or path is part or not self._tlog(spec).exists()
            if path.exists():
                with suppress(TruthError):  # killed before it wrote its header
                    track = read_truth(path)
                    tracks += [track] if len(track) else []
        verdict = judge(self.scenario, self.starts, tracks, self.ready_at, now)
        exit_code = result.exit_code
        if exit_code == PASSED and not verdict.passed:
            exit_code = FAILED
        error = result.error
        if exit_code == TIMED_OUT:
            error = f"timed out: not done after {self.scenario.duration:g} s of simulated time"
        lockstep = self.options.lockstep
        late, ticks = (clock.late, clock.ticks) if clock else (0, 0)
        if not lockstep:
            both = self._coordinators, self._vehicles
            late = sum(process.late for group in both for process in group)
            ticks = sum(process.ticks for group in both for process in group)
        facts = RunFacts(
            run_id=self.run_id,
            seed=self.scenario.seed,
            law=self.scenario.team.law,
            lockstep=lockstep,
            speed=self.options.speed or (None if lockstep else 1.0),
            duration_s=now,
            wall_s=self._wall_s,
            real_time_factor=now / self._wall_s if self._wall_s else 0.0,
            digest=self._digest() if lockstep else None,
            outside_clients=sum(v.outside_clients for v in self._vehicles),
            partial=self._partial or missing,
            ticks=ticks,
            late_ticks=late,
            error=error,
            exit_code=exit_code,
            version=__version__,
            python=platform.python_version(),
            platform=platform.platform(),
            ports=self.ports,
        )
        report = build_report(self.scenario, verdict, facts)
        figures = self.options.figures and exit_code != INTERRUPTED
        notes = write_report(
            self.folder, report, self.scenario, self.starts, tracks, verdict, figures=figures
        )
        if self.options.record and find_spec("rerun") is None:
            notes.append("rerun-sdk is missing, so no recording (pip install 'mavherd[view]')")
        return Outcome(exit_code, self.folder, report, notes)

    def _digest(self) -> str | None:
        logs = [self._tlog(spec) for spec in sorted(self.starts, key=lambda s: s.system_id)]
        return digest(logs) if all(log.exists() for log in logs) else None

    def _tlog(self, spec: RobotSpec) -> Path:
        return self.folder / "vehicles" / spec.name / f"{spec.name}.tlog"

    # Ctrl-C

    def _interrupted(self) -> bool:
        return self._signals > 0

    @contextmanager
    def _interruptible(self) -> Iterator[None]:
        """Turn Ctrl-C and SIGTERM into an orderly end; processes are ended, the report written."""

        def note(signum: int, frame: FrameType | None) -> None:
            self._signals += 1

        try:
            before = {s: signal.signal(s, note) for s in (signal.SIGINT, signal.SIGTERM)}
        except ValueError:  # not in the main thread: the caller has its own way to stop
            yield
            return
        try:
            yield
        finally:
            for signum, handler in before.items():
                signal.signal(signum, handler)


def _latest_team(box: Mailbox) -> list[VehicleState]:
    data = box.latest.get("team")
    return unpack_team(data)[1] if data else []


def _left(deadline: float) -> float:
    return max(0.01, deadline - time.monotonic())


def _half_close(sock: socket.socket) -> None:
    with suppress(OSError):  # the other end may be gone already
        sock.shutdown(socket.SHUT_WR)
