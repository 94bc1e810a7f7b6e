"""The process around one coordinator: its pace, and its end.

Run by the launcher as `python -m mavherd.gcs.team.coordinator_process FD`. Over the channel FD come
sockets, and then a line that becomes a `Job`. In lockstep each further line grants ticks and is
answered when they are done; free-running, lines go out when there is something to tell.
End-of-file means stop: our own vehicles are left to whoever ends their processes, external ones
are brought to rest first.
"""

import select
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...scenarios.loader import load_scenario
from ...transport.bus import Bus
from ...transport.channel import Channel, ChannelClosed
from ...transport.child import log_to, settle
from ...transport.errors import MavherdError, os_reason
from .barrier import STALL_S, Barrier, Died, VehicleHandle, serve
from .exchange import REPEAT_S
from .ground import Ground

_SIGN_OF_LIFE_S = 1.0  # free-running, the launcher hears from us at least so often
_MAX_LAG_S = 0.5
_MAX_REPEAT_S = 2.0  # while a run is paused
_BREATH_S = 0.004  # free-running, between two looks at what the vehicles have sent


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """What a coordinator is started with."""

    folder: str  # the run folder; holds scenario.yaml
    run_id: str
    endpoint: str  # of the Zenoh router
    own: dict[str, int | None]  # vehicle name -> file descriptor of its socket; None: external
    conducted: list[
        tuple[str, int, int]
    ]  # lockstep: name, pid and control socket of each own vehicle
    lockstep: bool
    started: float = 0.0  # time.monotonic() at which fleet time was 0, free-running


class CoordinatorProcess:
    """Serves the launcher's channel: a tick for each grant, or one after another by itself."""

    def __init__(self, job: Job, bus: Bus) -> None:
        scenario = load_scenario(Path(job.folder) / "scenario.yaml")
        self.job = job
        self.ground = Ground(
            scenario,
            {n: None if fd is None else socket.socket(fileno=fd) for n, fd in job.own.items()},
            folder=Path(job.folder),
            bus=bus,
            lockstep=job.lockstep,
            started=job.started,
        )
        self.core = self.ground.core
        self._conducted = [
            VehicleHandle(name, pid, socket.socket(fileno=fd)) for name, pid, fd in job.conducted
        ]
        self.late = 0
        self._barrier: Barrier | None = None
        self._period = 1.0 / scenario.team.rate_hz
        self._ticks = 0

    def run_lockstep(self, channel: Channel) -> None:
        """Serve the ticks that each line grants until end-of-file."""

        def look() -> None:
            if channel.ended:
                raise ChannelClosed

        def stalled(name: str, since: float) -> None:
            text = f"no answer to the tick after {since:.2f} s for {STALL_S:g} s: all wait for it"
            self.core.tell(since, name, "stall", text)
            channel.send({"events": self.core.take_events()})

        barrier = self._barrier = Barrier(self._conducted, look, stalled)
        exchange = self.ground.exchange
        patience = REPEAT_S
        while True:
            grant = channel.receive(None if exchange.alone else patience)
            if grant is None:  # somebody may wait for a state of ours that it has missed
                exchange.repeat()
                patience = min(2 * patience, _MAX_REPEAT_S)
                continue
            patience = REPEAT_S
            channel.send(serve(grant, barrier, self.ground))

    def run_free(self, channel: Channel) -> None:
        """Tick with the wall clock until end-of-file."""
        told: tuple[bool, bool] | None = None
        speak_by = 0.0
        for _ in self._tick_by_wall_clock(channel):
            events, core = self.core.take_events(), self.core
            if events or told != (core.prepared, core.finished) or time.monotonic() > speak_by:
                told = core.prepared, core.finished
                speak_by = time.monotonic() + _SIGN_OF_LIFE_S
                channel.send(
                    {
                        "events": events,
                        "prepared": core.prepared,
                        "finished": core.finished,
                        "late": self.late,
                    }
                )

    def bring_to_rest(self, channel: Channel) -> None:
        """Leave no external vehicle under way. SIGTERM says: now, with what was sent so far."""
        core = self.core
        if not any(member.spec.external for member in core.members.values()):
            return
        core.come_to_rest(self._now, "hold" if core.finished else core.scenario.team.at_end)
        impatient = threading.Event()
        signal.signal(signal.SIGTERM, lambda *_: impatient.set())
        for _ in self._tick_by_wall_clock():
            with suppress(ChannelClosed):  # the launcher may be dead: that is why we do this
                channel.send({"events": core.take_events()})
            if core.at_rest or impatient.is_set():
                return

    def _tick_by_wall_clock(self, channel: Channel | None = None) -> Iterator[None]:
        """Tick, and yield after each tick, until end-of-file on `channel`."""
        due = time.monotonic()
        while True:
            due += self._period
            while (wait := due - time.monotonic()) > 0:
                others = [channel.socket] if channel else []
                ready, _, _ = select.select([*others, *self.ground.sockets()], [], [], wait)
                if channel and channel.socket in ready:
                    return  # nothing but end-of-file comes here
                self.ground.drain(self._now, ready)
                # What comes now can wait for a moment: a wake-up for each datagram costs more.
                time.sleep(max(0.0, min(_BREATH_S, due - time.monotonic())))
            self.ground.tick_free(self._now)
            yield
            lag = time.monotonic() - due
            self._ticks += 1
            if lag < _MAX_LAG_S:
                self.late += lag > self._period
            else:
                self.late += int(lag / self._period)
                due += lag

    @property
    def _now(self) -> float:
        return time.monotonic() - self.job.started

    def so_far(self) -> dict[str, Any]:
        """Return what goes with the word that we break off: no answer has told it yet."""
        done = {"done": self._barrier.done} if self._barrier else {}
        return {"events": self.core.take_events(), **done}

    def facts(self) -> dict[str, int]:
        """Return what the report wants to know at the end."""
        return {"late": self.late, "ticks": self._ticks}

    def close(self) -> None:
        """Finish the logs, leave the bus and close the sockets."""
        self.ground.close()
        for vehicle in self._conducted:
            vehicle.control.close()


def main(fd: int) -> int:
    """Serve the channel on `fd`; return the exit code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the launcher decides
    settle()
    channel = Channel(socket.socket(fileno=fd))
    process = None
    try:
        job = _job(channel)
        bus = Bus.client(job.endpoint, job.run_id, reliable=job.lockstep)
        process = CoordinatorProcess(job, bus)
        channel.send({"ready": True})
        if job.lockstep:
            process.run_lockstep(channel)
        else:
            process.run_free(channel)
    except ChannelClosed:
        pass
    except (MavherdError, OSError) as error:  # OSError: the disk is full, say
        with suppress(ChannelClosed):
            channel.send(_reason(error) | (process.so_far() if process else {}))
    finally:  # whatever else it was, events and how far we came go with the last word
        if process:
            with suppress(MavherdError, OSError):
                process.bring_to_rest(channel)
            with suppress(ChannelClosed):
                channel.send({"parted": process.facts(), **process.so_far()})
            with suppress(OSError):
                process.close()
        channel.close()
    return 0


def _reason(error: MavherdError | OSError) -> dict[str, Any]:
    """Return what makes us break off, as the launcher takes it."""
    if isinstance(error, Died):
        return {"died": [error.name, error.pid, error.now]}
    return {"error": os_reason(error) if isinstance(error, OSError) else str(error)}


def _job(channel: Channel) -> Job:
    """Wait for the job; sockets come ahead of it: vehicles' links first, then their controls."""
    while not (message := channel.receive()):
        pass
    log_to(message.pop("log"))
    fds = iter(channel.fds)
    links = {name: next(fds) for name in message.pop("linked")}
    message["own"] = {name: links.get(name) for name in message["own"]}
    message["conducted"] = [(name, pid, next(fds)) for name, pid in message["conducted"]]
    return Job(**message)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1])))
