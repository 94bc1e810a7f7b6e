"""How fleet time passes for a script: tick by tick while it waits, or by itself.

In lockstep there is no thread: every call that waits grants ticks, and the script is thereby the
one who is waited for; between two calls simulated time stands still. Free-running, one thread
sends setpoints at the coordination rate, so the stream ends with the process, whatever it does.
"""

import select
import socket
import threading
import time
from contextlib import AbstractContextManager, nullcontext, suppress
from typing import Any, Protocol

from ...transport.errors import MavherdError, os_reason
from ..run.conductor import CoordinatorHandle, Died, FreeRun, Interrupted, Lockstep
from ..run.open_run import OpenRun
from ..run.pacing import Pacer
from ..team.barrier import Barrier, serve
from ..team.ground import Ground
from .errors import FleetError

_STEP_S = 0.2  # how long a free-running script waits at most before it looks about
_MAX_LAG_S = 0.5


class Pace(Protocol):
    """Lets fleet time pass. Whoever reads or gives orders meanwhile holds `lock`."""

    @property
    def lock(self) -> AbstractContextManager[Any]:
        """Held during a tick."""
        ...

    @property
    def broken(self) -> bool:
        """Whether time cannot go on."""
        ...

    @property
    def failed(self) -> bool:
        """Whether a process of the run has failed; then time may go on, but only to end it."""
        ...

    @property
    def now(self) -> float:
        """Fleet time, s."""
        ...

    def step(self, *, anyhow: bool = False) -> None:
        """Let one coordination period pass; raise FleetError when that cannot be.

        So it does, unless `anyhow`, when a process has `failed`.
        """
        ...

    def close(self) -> None:
        """Let no more time pass."""
        ...


class InProcess:
    """The conductor's end of a coordinator that lives in this very process."""

    def __init__(self, barrier: Barrier, ground: Ground) -> None:
        self._barrier = barrier
        self._ground = ground
        self._answer: dict[str, Any] | None = None
        self.socket, self._other = socket.socketpair()  # nothing ever comes here

    @property
    def ended(self) -> bool:
        """Return False: it is here as long as we are."""
        return False

    def send(self, message: dict[str, Any]) -> None:
        """Do the ticks that are granted."""
        self._answer = serve(message, self._barrier, self._ground)

    def receive(self, timeout: float | None = None) -> dict[str, Any] | None:
        """Return what came of it."""
        answer, self._answer = self._answer, None
        return answer

    def close(self) -> None:
        """End the conversation."""
        self.socket.close()
        self._other.close()


class LockstepPace:
    """Grants one tick at a time to the run's vehicles and coordinators, ours last."""

    def __init__(self, run: OpenRun, clock: Lockstep, ground: Ground) -> None:
        self.lock: AbstractContextManager[Any] = nullcontext()  # there is no other thread
        self.broken = False
        self._closed = False
        self._run = run
        self._clock = clock
        by_name = {vehicle.name: vehicle for vehicle in clock.vehicles}
        ours = [by_name[name] for name in ground.core.members if name in by_name]
        self._partner = InProcess(Barrier(ours, self._look), ground)
        handle = CoordinatorHandle("this script", self._partner)
        clock.coordinators = [*clock.coordinators, handle]
        self._ticks = run.bus.publisher("clock")
        self._period = 1.0 / run.scenario.team.rate_hz
        speed = run.options.speed
        self._pacer = Pacer(speed, self._period) if speed else None

    @property
    def failed(self) -> bool:
        """Whether the run has broken off: without everybody there is no tick."""
        return self.broken

    @property
    def now(self) -> float:
        """Fleet time, s."""
        return self._clock.now

    def step(self, *, anyhow: bool = False) -> None:
        """Advance everybody by one period."""
        if self._closed:
            raise FleetError("the fleet is closed")
        if self.broken:
            raise FleetError("the run has broken off; time cannot go on")
        self.broken = True  # until the tick is whole
        try:
            self._clock.tick(round(self._period * 1e6))
        except Died as died:
            raise FleetError(self._run.crew.obituary(died)) from None
        except Interrupted:
            raise KeyboardInterrupt from None
        except OSError as error:
            raise FleetError(os_reason(error)) from None
        self.broken = False
        self._ticks.put(f"{self._clock.now:.6f}".encode())
        if self._pacer:
            self._pacer.wait()
            self._clock.late = self._pacer.late

    def close(self) -> None:
        """Let no more time pass."""
        self._closed = True
        self._partner.close()

    def _look(self) -> None:
        if self._clock.interrupted():
            raise Interrupted


class FreePace:
    """Follows the wall clock in a thread of its own."""

    def __init__(self, run: OpenRun, clock: FreeRun, ground: Ground) -> None:
        self._turn = threading.Condition(threading.RLock())
        self.lock: AbstractContextManager[Any] = self._turn
        self._run = run
        self._clock = clock
        self._ground = ground
        self._period = 1.0 / run.scenario.team.rate_hz
        self._error: BaseException | None = None
        self._failure: Exception | None = None  # of another process; ours are steered on
        self._stopping = False
        self._thread = threading.Thread(target=self._serve, name="mavherd fleet", daemon=True)
        self._thread.start()

    @property
    def broken(self) -> bool:
        """Whether time cannot go on."""
        return self._error is not None or not self._thread.is_alive()

    @property
    def failed(self) -> bool:
        """Whether time cannot go on, or another process has failed."""
        return self.broken or self._failure is not None

    @property
    def now(self) -> float:
        """Fleet time, s."""
        return time.monotonic() - self._run.started

    def step(self, *, anyhow: bool = False) -> None:
        """Wait for the next tick; nobody may who is called in one, as the path of a follow is."""
        if threading.current_thread() is self._thread:
            raise FleetError("a path to follow cannot wait: it is asked within a tick")
        with self._turn:
            if not self.broken:
                self._turn.wait(_STEP_S)
        match self._error or (None if anyhow else self._failure):
            case None if self.broken:
                raise FleetError("the fleet is closed")
            case None:
                return
            case Died() as died:
                raise FleetError(self._run.crew.obituary(died))
            case MavherdError() as error:
                raise FleetError(str(error)) from error
            case OSError() as error:
                raise FleetError(os_reason(error)) from error
            case error:
                raise error

    def close(self) -> None:
        """Stop the stream of setpoints."""
        self._stopping = True
        self._thread.join()

    def _serve(self) -> None:
        try:
            due = time.monotonic()
            while not self._stopping:
                due += self._period
                self._listen(due)
                with self._turn:
                    self._tick()
                    self._turn.notify_all()
                due += self._lag(time.monotonic() - due)
        except BaseException as error:  # raised again where the script waits
            with self._turn:
                self._error = error
                self._turn.notify_all()

    def _lag(self, lag: float) -> float:
        """Count a tick, `lag` seconds late; return by how much to skip rather than race."""
        self._clock.ticks += 1
        if lag < _MAX_LAG_S:
            self._clock.late += lag > self._period
            return 0.0
        self._clock.late += int(lag / self._period)
        return lag

    def _listen(self, due: float) -> None:
        """Take in what comes until the next tick is due."""
        while (wait := due - time.monotonic()) > 0:
            ready: list[socket.socket] = []
            with suppress(OSError, ValueError):  # a line that is being closed and opened again
                ready, _, _ = select.select(self._ground.sockets(), [], [], wait)
            with self._turn:
                self._ground.drain(self.now, ready)

    def _tick(self) -> None:
        self._ground.tick_free(self.now)
        for event in self._ground.core.take_events():
            self._run.note(event)
        if self._failure is not None:
            self._clock.now = self.now
            return
        try:
            self._clock.listen(self._run.started, 0.0)
        except Interrupted:
            pass  # raised where the script waits; nobody waits here
        except (MavherdError, OSError) as failure:
            self._failure = failure
