"""The process around one coordinator: its vehicles' sockets, its Zenoh session, its pace.

Run by the launcher as `python -m mavherd.gcs.coordinator_process FD`; the first line on the
channel FD is a `Job`. In lockstep each further line grants one tick and is answered when the tick
is done; free-running, lines go out when there is something to tell. End-of-file means stop.
"""

import gc
import select
import signal
import socket
import sys
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ..scenarios.loader import load_scenario
from ..transport.bus import Bus, Mailbox, Publisher
from ..transport.channel import Channel, ChannelClosed
from ..transport.errors import MavherdError, VehicleError
from ..transport.links import patience
from ..transport.tlog import TlogWriter
from ..transport.wire import (
    VehicleState,
    WireError,
    pack_state,
    pack_target,
    pack_team,
    unpack_state,
)
from ..vehicles.config import SIMULATED_EPOCH_US
from ..vehicles.nursery import GC_THRESHOLD
from ..vehicles.process import LIVENESS_S
from .coordinator import Coordinator

_DATAGRAM = 65535
_REPEAT_S = 0.05  # a state that somebody may have missed while joining is sent again
_SIGN_OF_LIFE_S = 1.0  # free-running, the launcher hears from us at least so often
_MAX_LAG_S = 0.5
_LOOK_EVERY = 10  # ticks between two looks at who listens
TARGET_HZ = 5  # on the bus, for those who watch; the vehicles get every one
_PRESENT_S = 3.0  # without a heartbeat for so long a vehicle is no longer present


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """What a coordinator is started with."""

    folder: str  # the run folder; holds scenario.yaml
    run_id: str
    endpoint: str  # of the Zenoh router
    own: dict[str, int]  # vehicle name -> file descriptor of its socket
    lockstep: bool
    started: float = 0.0  # time.monotonic() at which fleet time was 0, free-running


class CoordinatorProcess:
    """Drives a `Coordinator` with real sockets and a real bus."""

    def __init__(self, job: Job, bus: Bus) -> None:
        scenario = load_scenario(Path(job.folder) / "scenario.yaml")
        own = tuple(job.own)
        self.job = job
        self.sockets = {name: socket.socket(fileno=fd) for name, fd in job.own.items()}
        self.tlogs = {
            name: TlogWriter(Path(job.folder) / "vehicles" / name / f"{name}.tlog") for name in own
        }
        epoch = SIMULATED_EPOCH_US if job.lockstep else round(time.time() * 1e6)
        taps = {
            name: lambda frame, now, log=log: log.write(epoch + round(now * 1e6), frame)
            for name, log in self.tlogs.items()
        }
        self.core = Coordinator(scenario, own, taps)
        self.alone = len(own) == len(scenario.robots)
        self.late = 0
        self._period = 1.0 / scenario.team.rate_hz
        self._target_every = max(1, round(scenario.team.rate_hz / TARGET_HZ))
        self._bus = bus
        self._states = {n: bus.publisher(f"vehicle/{n}/state") for n in own}
        self._targets = {n: bus.publisher(f"vehicle/{n}/target") for n in own}
        self._team: Publisher | None = bus.publisher("team") if self.alone else None
        self._others = Mailbox() if self.alone else bus.latest("vehicle/*/state")
        self._tokens = {n: bus.declare_token(f"vehicle/{n}/alive") for n in own}
        self._packed: dict[str, bytes] = {}  # our states of this tick
        self._followed: set[str] = set()  # whose states somebody listens to
        self._watched: set[str] = set()  # and whose targets
        self._present = dict.fromkeys(own, True)
        self._tick = 0

    def run_lockstep(self, channel: Channel) -> None:
        """Serve one tick for each line until end-of-file."""
        for sock in self.sockets.values():
            patience(sock, LIVENESS_S)
        while True:
            grant = channel.receive(None if self.alone else _REPEAT_S)
            if grant is None:  # somebody may wait for a state of ours that it has missed
                self._repeat()
                continue
            now = grant["until_us"] * 1e-6
            for (name, sock), expected in zip(self.sockets.items(), grant["expect"], strict=True):
                for _ in range(expected):
                    try:
                        self.core.receive(name, sock.recv(_DATAGRAM), now)
                    except BlockingIOError:
                        raise VehicleError(
                            f"a datagram of {name} was lost at {now:.2f} s"
                        ) from None
            self._check_continuity()
            sent = self._exchange_and_tick(now)
            channel.send(
                {
                    "sent": [sent[name] for name in self.sockets],
                    "events": self.core.take_events(),
                    "finished": self.core.finished,
                }
            )

    def run_free(self, channel: Channel) -> None:
        """Tick with the wall clock until end-of-file."""
        by_socket = {sock: name for name, sock in self.sockets.items()}
        for sock in by_socket:
            sock.setblocking(False)
        due = time.monotonic()
        told, speak_by = False, 0.0
        while True:
            due += self._period
            while (wait := due - time.monotonic()) > 0:
                ready, _, _ = select.select([channel.socket, *by_socket], [], [], wait)
                if channel.socket in ready:
                    return  # nothing but end-of-file comes here
                self._drain(by_socket[sock] for sock in ready)
            self._drain(self.sockets)
            self._exchange_and_tick(time.monotonic() - self.job.started)
            events, finished = self.core.take_events(), self.core.finished
            if events or finished != told or time.monotonic() > speak_by:
                told = finished
                speak_by = time.monotonic() + _SIGN_OF_LIFE_S
                channel.send({"events": events, "finished": finished, "late": self.late})
            lag = time.monotonic() - due
            self._tick += 1
            if lag < _MAX_LAG_S:
                self.late += lag > self._period
            else:
                self.late += int(lag / self._period)
                due += lag

    def facts(self) -> dict[str, int]:
        """Return what the report wants to know at the end."""
        return {"late": self.late, "ticks": self._tick}

    def close(self) -> None:
        """Finish the logs and leave the bus."""
        for log in self.tlogs.values():
            log.close()
        self._bus.close()

    def _drain(self, names: Iterable[str]) -> None:
        for name in names:
            now = time.monotonic() - self.job.started
            with suppress(OSError):  # nothing more, or the vehicle is gone: ages tell
                for _ in range(64):
                    self.core.receive(name, self.sockets[name].recv(_DATAGRAM), now)

    def _check_continuity(self) -> None:
        for name, member in self.core.members.items():
            if member.station.codec.lost:
                raise VehicleError(f"{name}: a MAVLink frame was lost in lockstep")

    def _exchange_and_tick(self, now: float) -> dict[str, int]:
        """Share states, decide, send; return the number of datagrams for each vehicle."""
        states = self.core.states()
        packed = self._packed = {state.name: pack_state(state) for state in states}
        self._publish(packed, now)
        if self._team:
            known = [packed[state.name] for state in states if state.time >= 0]
            self._team.put(pack_team(self.core.sequence, known))
        else:
            states = self._gather(now, packed)
        sent = dict.fromkeys(self.sockets, 0)
        for name, data in self.core.tick(now, states).items():
            if data:
                with suppress(ConnectionError):  # a dead vehicle is the launcher's business
                    self.sockets[name].send(data)
                    sent[name] = 1
        for turn, (name, publisher) in enumerate(self._targets.items(), self.core.sequence):
            target = self.core.members[name].target
            if target and turn % self._target_every == 0 and name in self._watched:
                publisher.put(pack_target(target))
        return sent

    def _publish(self, packed: dict[str, bytes], now: float) -> None:
        if self.core.sequence % _LOOK_EVERY == 1:
            self._followed = {n for n, p in self._states.items() if not self.alone or p.wanted}
            self._watched = {n for n, p in self._targets.items() if p.wanted}
        for name in self._followed:
            self._states[name].put(packed[name])
        for name, member in self.core.members.items():
            silent = now - max(0.0, member.station.status.heartbeat_at)
            if self._present[name] != (silent < _PRESENT_S):
                self._present[name] = silent < _PRESENT_S
                if self._present[name]:
                    self._tokens[name] = self._bus.declare_token(f"vehicle/{name}/alive")
                else:
                    self._tokens[name].undeclare()

    def _gather(self, now: float, own: dict[str, bytes]) -> list[VehicleState]:
        """Return the states of all vehicles, in lockstep those of this very tick."""
        deadline = time.monotonic() + LIVENESS_S
        names = [r.name for r in self.core.scenario.robots]
        while True:
            self._others.arrived.clear()
            heard = self._others.latest
            team = {}
            for name in names:
                data = own.get(name) or heard.get(f"vehicle/{name}/state")
                if data is None:
                    continue
                try:
                    team[name] = unpack_state(data)
                except WireError as error:
                    self.core.tell(now, name, "bus", str(error))
                    del heard[f"vehicle/{name}/state"]
            late = [
                name
                for name in names
                if name not in team or team[name].sequence != self.core.sequence
            ]
            if not late or not self.job.lockstep:
                return list(team.values())
            if time.monotonic() > deadline:
                raise VehicleError(f"no state of {', '.join(late)} came over Zenoh at {now:.2f} s")
            if not self._others.arrived.wait(_REPEAT_S):
                self._repeat()

    def _repeat(self) -> None:
        """Send our newest states again, for coordinators whose subscription came too late."""
        for name, data in self._packed.items():
            self._states[name].put(data)


def main(fd: int) -> int:
    """Serve the channel on `fd`; return the exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the launcher decides
    gc.freeze()
    gc.set_threshold(GC_THRESHOLD)
    channel = Channel(socket.socket(fileno=fd))
    process = None
    try:
        first = channel.receive()
        job = Job(**(first or {}))
        bus = Bus.client(job.endpoint, job.run_id, reliable=job.lockstep)
        process = CoordinatorProcess(job, bus)
        channel.send({"ready": True})
        if job.lockstep:
            process.run_lockstep(channel)
        else:
            process.run_free(channel)
        with suppress(ChannelClosed):
            channel.send(process.facts())
    except ChannelClosed:
        pass
    except (MavherdError, OSError) as error:  # OSError: the disk is full, say
        with suppress(ChannelClosed):
            channel.send(
                {"error": str(error), "events": process.core.take_events() if process else []}
            )
    finally:
        if process:
            with suppress(OSError):
                process.close()
        channel.close()
    return 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1])))
