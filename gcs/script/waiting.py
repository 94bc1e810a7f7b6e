"""What a script waits for, in the vehicles' own time, and how a wait ends."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...scenarios.errors import did_you_mean, show
from ...transport.mavlink import Message, mav
from ..station import Station
from ..station.status import said_since
from .errors import FleetError, LinkLost, Refused, TimedOut

if TYPE_CHECKING:
    from .orders import Task
    from .vehicle import Vehicle

DEFAULT_S = 120.0  # of the vehicle's own time
SILENT_S = 10.0  # a vehicle not heard for so long is lost
_ASK_AFTER_S = 1.0  # for a message that does not come by itself


class Timer:
    """Seconds of a vehicle's own time since now: an external one counts its own since boot."""

    def __init__(self, station: Station, now: float) -> None:
        self._station = station
        self._last = self._read(now)
        self.elapsed = 0.0

    def count(self, now: float) -> float:
        """Return the time gone by; a reboot starts the vehicle's clock anew, not this one."""
        at = self._read(now)
        self.elapsed += max(0.0, at - self._last)
        self._last = at
        return self.elapsed

    def _read(self, now: float) -> float:
        boot = self._station.status.boot_s
        return boot if self._station.external and boot >= 0 else now


@dataclass(slots=True)
class Waiting:
    """Waits until `done` returns True; `what` says for what, in errors. No timeout: for ever."""

    vehicle: "Vehicle"
    what: str
    done: Callable[[], bool]
    timeout: float | None
    timer: Timer | None = None
    asked_at: float = 0.0

    def look(self, now: float) -> bool:
        """Return whether the wait is over; raise FleetError when it is in vain."""
        status = self.vehicle.station.status
        if self.timer is None:
            self.timer, self.asked_at = Timer(self.vehicle.station, now), now
        if self.done():
            return True
        if problem := self.vehicle.station.problem:
            raise Refused(f"{self.vehicle.name}: {self.what}: {problem}")
        silent = now - max(0.0, status.heartbeat_at, self.asked_at - SILENT_S / 2)
        if silent > SILENT_S:
            raise LinkLost(
                f"{self.vehicle.name}: {self.what}: nothing heard for {silent:.0f} s "
                "(is it still there, and the link?)"
            )
        if self.timeout is not None and self.timer.count(now) > self.timeout:
            raise TimedOut(
                f"{self.vehicle.name}: {self.what}: not done after {self.timeout:g} s of its time; "
                f"{self._whereabouts()}{said_since(status.texts, self.asked_at)} "
                "(timeout=... allows more)"
            )
        return False

    def _whereabouts(self) -> str:
        state = self.vehicle.state
        if state.time < 0:
            return "it has told no position yet"
        east, north, up = state.position
        armed = "armed" if state.armed else "disarmed"
        return (
            f"it is at east {east:z.1f}, north {north:z.1f}, up {up:z.1f}, {armed}, in {state.mode}"
        )


def done_or_raise(vehicle: "Vehicle", task: "Task", what: str) -> Callable[[], bool]:
    """Return a condition that is true when the order is done, and raises what went wrong."""

    def done() -> bool:
        if task.error is not None:
            raise task.error
        if not task.done and vehicle.conduct.task is not task:
            raise FleetError(f"{vehicle.name}: {what}: another order has taken its place")
        return task.done

    return done


class Ear:
    """Keeps the newest of those messages that somebody waits for."""

    def __init__(self, station: Station) -> None:
        self._newest: dict[str, Message | None] = {}
        station.listen(self._hear)

    def expect(self, name: str) -> None:
        """Wait for a message from now on; raise FleetError when MAVLink has none of that name."""
        if name not in _IDS:
            raise FleetError(unknown("MAVLink message", name, _IDS))
        self._newest[name] = None

    def has(self, name: str) -> bool:
        """Return whether it has come."""
        return self._newest.get(name) is not None

    def fields(self, name: str) -> dict[str, Any]:
        """Return the fields of the one that has come, and wait for it no more."""
        message = self._newest.pop(name)
        values: dict[str, Any] = message.to_dict() if message else {}
        values.pop("mavpackettype", None)
        return values

    def _hear(self, m: Message, now: float) -> None:
        if m.get_type() in self._newest:
            self._newest[m.get_type()] = m


class Asking:
    """The condition that a message has come; asks the vehicle for one that stays away."""

    def __init__(self, station: Station, ear: Ear, name: str, clock: Callable[[], float]) -> None:
        self._station, self._ear, self._name, self._clock = station, ear, name, clock
        self._ask_at = clock() + _ASK_AFTER_S

    def __call__(self) -> bool:
        """Return whether it has come."""
        now = self._clock()
        if not self._ear.has(self._name) and now > self._ask_at:
            self._ask_at = now + 2 * _ASK_AFTER_S
            params = (float(_IDS[self._name]),)
            self._station.command(mav.MAV_CMD_REQUEST_MESSAGE, params, self._name, now)
        return self._ear.has(self._name)


def unknown(what: str, name: str, known: Collection[str]) -> str:
    """Return the complaint about a name that does not exist, with the nearest that does."""
    hint = did_you_mean(name, known)
    return f"no {what} is called {show(name)}" + (f" ({hint})" if len(hint) < 300 else "")


_IDS: dict[str, int] = {kind.msgname: number for number, kind in mav.mavlink_map.items()}
