"""The crew of a run: every process that it starts, watches and ends, and the ports they use."""

import json
import socket
import time
from collections.abc import Callable, Collection
from contextlib import ExitStack, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ...scenarios.schema import RobotSpec, Scenario
from ...transport.channel import ChannelClosed
from ...transport.errors import LinkError, VehicleError
from ...transport.links import socket_pair_udp
from ...vehicles.grants import LIVENESS_S
from ..report.costs import Costs
from .children import READY_S, Child, Nursery, hand_over, how_it_ended
from .conductor import CoordinatorHandle, Died, Interrupted, VehicleHandle
from .head_start import HeadStart
from .onboard import vehicle_config
from .parting import END_S, Note, came_up, half_close, hear_out, left, part
from .ports import LOOPBACK, PortPlan
from .recording import Recorder
from .view import Step

_RECORDER_END_S = 20.0
_TELL_S = 0.5  # for the nursery to tell how vehicles have ended that have said their last word
_CAUSE_S = 3.0  # to learn how a process has ended that is gone
_TOLD = 4  # times, while vehicles start
_MORE_S = 0.2  # in a hurry, for vehicles to end, then for the nursery, then for the recorder


class Crew:
    """Vehicles, coordinators and recorder of one run.

    `starts` are the robots where the seed has put them. `interrupted` is asked during every wait.
    Ports are taken at once: raises LinkError when one that was set by hand cannot be had.
    """

    def __init__(
        self,
        scenario: Scenario,
        starts: tuple[RobotSpec, ...],
        ports: PortPlan,
        interrupted: Callable[[], bool],
        head_start: HeadStart,
    ) -> None:
        self.vehicles: list[VehicleHandle] = []
        self.coordinators: list[CoordinatorHandle] = []
        self.ends: dict[str, socket.socket] = {}  # our end of the sockets of those in `ours`
        self.ports: dict[str, Any] = {}
        self.missing: list[str] = []  # from the run folder, a line for each thing
        self._scenario = scenario
        self._starts = starts
        self._interrupted = interrupted
        self._head_start = head_start
        self._plan = ports
        self._sockets = ExitStack()  # that were opened for vehicles, wherever they have got to
        self._served: dict[str, socket.socket | None] = {}
        self._nursery: Nursery | None = None
        self._recorder: Recorder | None = None
        self._children: list[Child] = []  # one for each coordinator
        self._is_up = False  # all of them
        try:
            for spec in starts:
                if spec.external:  # somebody else has started it
                    continue
                self._served[spec.name] = ports.listen(spec.system_id - 1)
        except LinkError:
            self.release()
            raise

    def start(
        self,
        folder: Path,
        endpoint: str,
        *,
        lockstep: bool,
        started: float,
        record: bool,
        serve: int | None = None,
        ours: Collection[str] = (),
        step: Step = lambda _: None,
    ) -> None:
        """Start everybody and wait until they are ready; `step` is told what is waited for.

        `endpoint` is Zenoh's; free-running, fleet time is 0 at `started` on the monotonic clock.
        The recorder writes a file if we are to `record`, and lets viewers come to the port `serve`.
        Vehicles in `ours` get no coordinator: the caller is theirs, and finds its ends in `ends`.
        """
        self._folder = folder
        self._step = step
        if (record or serve is not None) and find_spec("rerun") is not None:
            self._recorder = Recorder(folder, endpoint, folder.name, serve=serve, keep=record)
        self._nursery = self._head_start.nursery()
        self._nursery.log_to(folder / "launcher.txt")
        common = {"lockstep": lockstep, "started": started}
        ends = self._start_vehicles(self._nursery, common)
        self.ports["zenoh"] = endpoint
        text = json.dumps(self.ports, indent=1)
        (folder / "ports.json").write_text(text + "\n", encoding="utf-8")
        self.ends = {name: ends.pop(name) for name in ours if name in ends}
        names = [spec.name for spec in self._starts if spec.name not in ours]
        self._start_coordinators(names, ends, {"endpoint": endpoint, **common})
        self._wait_ready()
        self._is_up = True

    def _start_vehicles(self, nursery: Nursery, common: dict[str, Any]) -> dict[str, socket.socket]:
        """Start every vehicle of our own; return the coordinator's end of each one's socket."""
        ends: dict[str, socket.socket] = {}
        asked: list[tuple[str, socket.socket]] = []
        for spec in self._starts:
            if spec.connect is not None:
                self.ports[spec.name] = {
                    "system_id": spec.system_id,
                    "connect": spec.connect,
                    "udp": [],
                    "tcp": None,
                }
                continue
            ours, theirs = map(self._sockets.enter_context, socket_pair_udp())
            control, its_control = map(self._sockets.enter_context, socket.socketpair())
            tcp = self._served[spec.name]
            udp = self._plan.udp_targets(spec.system_id - 1)
            self.ports[spec.name] = {
                "system_id": spec.system_id,
                "udp": [f"{host}:{port}" for host, port in udp],
                "tcp": f"{LOOPBACK}:{tcp.getsockname()[1]}" if tcp else None,
            }
            request = {
                "config": vehicle_config(self._scenario, spec).to_json(),
                "folder": str((self._folder / "vehicles" / spec.name).absolute()),
                "udpout": udp,
                **common,
            }
            passed = [theirs, its_control, *([tcp] if tcp else [])]
            nursery.ask(request, passed)
            for sock in passed:
                sock.close()
            asked.append((spec.name, control))
            ends[spec.name] = ours
        nursery.fork()
        for up, (name, control) in enumerate(asked):
            if up * _TOLD % len(asked) < _TOLD:
                self._step(f"starting {len(asked)} vehicles, {up} are up")
            pid = nursery.pid(self._interrupted)
            self.vehicles.append(VehicleHandle(name, pid, control))
        return ends

    def _start_coordinators(
        self, names: list[str], ends: dict[str, socket.socket], common: dict[str, Any]
    ) -> None:
        together = self._scenario.team.coordinators == "central"
        by_name = {vehicle.name: vehicle for vehicle in self.vehicles}
        groups = [names] if together else [[name] for name in names]
        for own in filter(None, groups):
            name = "the coordinator" if together else f"the coordinator of {own[0]}"
            external = tuple(name for name in own if name not in by_name)
            child, channel = self._head_start.coordinator()
            self._children.append(child)
            handle = CoordinatorHandle(name, channel, external=external, prepared=not external)
            self.coordinators.append(handle)
            vehicles = [by_name[n] for n in own if n in by_name]
            conducted = vehicles if common["lockstep"] else []
            job = {
                "log": str((self._folder / "launcher.txt").absolute()),
                "folder": str(self._folder.absolute()),
                "run_id": self._folder.name,
                "own": own,
                "linked": [v.name for v in vehicles],
                "conducted": [(v.name, v.pid) for v in conducted],
                **common,
            }
            sockets = [ends[v.name] for v in vehicles] + [v.control for v in conducted]
            with suppress(ChannelClosed):  # it is dead already: noticed when it is not ready
                hand_over(channel, sockets)
                channel.send(job)
        for sock in ends.values():
            sock.close()

    def _wait_ready(self) -> None:
        allowed = READY_S + 0.5 * len(self.coordinators)
        deadline = time.monotonic() + allowed
        for coordinator in self.coordinators:
            self._step(f"waiting for {coordinator.name}")
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
                        f"{coordinator.name} could not start; see {self._folder}/launcher.txt"
                    ) from None
            if error := answer.get("error"):
                raise VehicleError(error)
            coordinator.ready = True
        recorder = self._recorder
        self._step("waiting for the recorder")
        while recorder and not recorder.wait_ready(0.1):
            if self._interrupted():
                raise Interrupted
            if time.monotonic() > deadline:
                recorder.kill("did not come up in time")
            if recorder.ended:
                return  # the run goes on without; `lost` tells

    def lost(self) -> str:
        """Return, once, why the recording has broken off; empty as long as it has not."""
        if self._recorder is None or not (loss := self._recorder.loss) or loss in self.missing:
            return ""
        self.missing.append(loss)
        return loss

    def show_lost(self) -> str:
        """Return why viewers can come no more; empty as long as they can."""
        return self._recorder.show_loss if self._recorder else ""

    def wait_serving(self, timeout: float) -> bool:
        """Return whether viewers may come to the recorder, within `timeout` seconds."""
        return self._recorder is not None and self._recorder.wait_serving(timeout)

    def end_serving(self) -> None:
        """Let no viewer come any more; what they hold they keep."""
        if self._recorder:
            self._recorder.dismiss()

    def stop(
        self,
        *,
        hurry: bool,
        note: Note = lambda _: None,
        insists: Callable[[], bool] = lambda: False,
        step: Step = lambda _: None,
    ) -> None:
        """End every process, coordinators first; nothing is left afterwards.

        Only frozen processes make us wait, in a `hurry` not for long in all. Coordinators of
        external vehicles bring those to rest first, which takes as long as a landing, and say so
        in events for `note`; they are cut short when the user `insists`. Who has not come up yet
        has nothing to finish, and may be in the midst of its imports: it is killed.
        """
        at_once = hurry and not self._is_up
        step("ending vehicles and coordinators")
        with self._sockets:
            deadline = self._end_coordinators(hurry, note, insists)
            if self._recorder and hurry:
                self._recorder.finish(hurry=True)
            for vehicle in self.vehicles:
                half_close(vehicle.control)
            deadline = deadline + _MORE_S if hurry else time.monotonic() + LIVENESS_S
            for vehicle in self.vehicles:
                if not at_once:
                    hear_out(vehicle, deadline)
        deadline = deadline + _MORE_S if hurry else time.monotonic() + 2 * END_S
        if self._nursery:
            if not at_once:
                self._nursery.hear_exits(
                    [v.pid for v in self.vehicles], min(_TELL_S, left(deadline))
                )
            self._nursery.close(0.0 if at_once else left(deadline))
        hurried = left(deadline + _MORE_S) if hurry else END_S
        if self._recorder:
            step("finishing the recording")
            self._recorder.close(_RECORDER_END_S, self._interrupted, hurried)

    def costs(self) -> Costs:
        """Return the processor time of everybody; call it when all have been stopped."""
        nursery, recorder = self._nursery, self._recorder
        coordinators = [child.cpu_s for child in self._children if child.cpu_s is not None]
        by_pid = nursery.costs if nursery else {}
        return Costs(
            vehicles=nursery.cpu_s if nursery and self.vehicles else None,
            coordinators=sum(coordinators) if coordinators else None,
            recorder=recorder.child.cpu_s if recorder else None,
            by_vehicle={v.name: by_pid[v.pid] for v in self.vehicles if v.pid in by_pid},
        )

    def _end_coordinators(self, hurry: bool, note: Note, insists: Callable[[], bool]) -> float:
        """End every coordinator; return until when all that could have taken."""
        for coordinator, child in zip(self.coordinators, self._children, strict=False):
            if hurry and not came_up(coordinator):
                child.kill()
            else:
                half_close(coordinator.channel.socket)
        deadline = time.monotonic() + (END_S if hurry else LIVENESS_S)
        for coordinator, child in zip(self.coordinators, self._children, strict=False):
            deadline = part(coordinator, child, deadline, note, insists)
        for child in self._children:
            child.end(left(deadline))
        return deadline

    def release(self) -> None:
        """Give back the ports that were taken for vehicles which never started."""
        for served in self._served.values():
            if served:
                served.close()

    def obituary(self, died: Died) -> str:
        """Return how a process has ended, and where it may have said why."""
        if died.pid is None:
            at = [c.name for c in self.coordinators].index(died.name)
            who, code = died.name, self._children[at].wait(_CAUSE_S)
            log = self._folder / "launcher.txt"
        else:
            who, code = f"{died.name} (pid {died.pid})", self._exit_code(died.pid)
            log = self._folder / "vehicles" / died.name / "log.txt"
        hint = f"; see {log}" if log.exists() and log.stat().st_size else ""
        return f"{who} {how_it_ended(code)} at {died.now:.2f} s{hint}"

    def _exit_code(self, pid: int) -> int | None:
        return self._nursery.exit_code(pid, _CAUSE_S) if self._nursery else None
