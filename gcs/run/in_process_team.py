"""A whole team in this process: its vehicles, its coordinators, and links that are bytes in memory.

The same objects as in processes of their own, under another shell; see docs/in-process.md.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ...scenarios.schema import RobotSpec, Scenario
from ...transport.errors import MavherdError, VehicleError
from ...transport.local_bus import LocalBus
from ...vehicles.config import SIMULATED_EPOCH_US, VehicleConfig
from ...vehicles.lockstep import advance
from ...vehicles.parameters import files
from ...vehicles.truth import PlaceLog, TruthLog
from ...vehicles.vehicle import Vehicle
from ..report.truth import Places, to_places
from ..safety.permission import external
from ..team.coordinator import check_laws
from ..team.seat import Seat
from .onboard import vehicle_config

Note = Callable[[dict[str, Any]], None]
"""Takes an event."""


class InProcess:
    """Everybody who takes part in a run of `scenario`, robots at their `starts`; `tick` them.

    It keeps fleet time as a conductor does. With a `folder` tlogs, truth and parameters are
    written there, otherwise nothing is. Raises MavherdError when the team cannot be run like this.
    """

    def __init__(
        self,
        scenario: Scenario,
        starts: tuple[RobotSpec, ...],
        note: Note,
        *,
        bus: LocalBus | None = None,
        folder: Path | None = None,
    ) -> None:
        if others := ", ".join(external(scenario)):
            raise MavherdError(f"{others}: external vehicles cannot be run in process")
        check_laws(scenario)
        self.now = 0.0  # s of fleet time
        self.ticks = 0
        self.late = 0  # counted by whoever paces us
        self._note = note
        self._rides = {
            spec.name: _Ride(
                vehicle_config(scenario, spec), folder and folder / "vehicles" / spec.name
            )
            for spec in starts
        }
        names = tuple(self._rides)
        together = scenario.team.coordinators == "central"
        bus = bus or LocalBus()
        self._seats = [
            Seat(
                scenario,
                own,
                bus,
                lockstep=True,
                folder=folder,
                epoch_us=SIMULATED_EPOCH_US,
            )
            for own in ([names] if together else [(name,) for name in names])
        ]

    def tick(self, period_us: int) -> None:
        """Advance everybody by one period; raise VehicleError when a coordinator gives up."""
        until_us = round(self.now * 1e6) + period_us
        now = until_us * 1e-6
        rides = self._rides
        for ride in rides.values():
            ride.advance(until_us)
        try:
            for seat in self._seats:
                for name in seat.core.members:
                    seat.core.receive(name, rides[name].sent, now)
                seat.offer(now)
            failure: MavherdError | None = None
            for seat in self._seats:
                try:
                    sent = seat.decide(now)
                except MavherdError as error:  # the others decide all the same
                    failure = failure or error
                    continue
                for name, data in sent.items():
                    rides[name].hear(data)
            if failure:
                raise failure
        except MavherdError as error:
            raise VehicleError(str(error)) from None
        finally:
            for seat in self._seats:
                for event in seat.core.take_events():
                    self._note(event)
        self.now = now
        self.ticks += 1

    @property
    def finished(self) -> bool:
        """Whether every coordinator's mission is over."""
        return all(seat.core.finished for seat in self._seats)

    def look(self) -> list[bytes]:
        """Return the states of the last tick, as `team` messages."""
        return [seat.exchange.known() for seat in self._seats]

    def expired(self, duration: float) -> bool:
        """Return whether the run has gone on for `duration` seconds."""
        return self.now >= duration - 1e-9

    @property
    def digest(self) -> str:
        """The SHA-256 over the bytes of all links, both directions, in order of system id."""
        sha = hashlib.sha256()
        for ride in sorted(self._rides.values(), key=lambda ride: ride.vehicle.config.system_id):
            sha.update(ride.traffic)
        return sha.hexdigest()

    @property
    def places(self) -> list[Places]:
        """Where every robot has been so far; nothing of a team whose truth is written."""
        return [
            to_places(ride.vehicle.config, ride.truth.rows)
            for ride in self._rides.values()
            if isinstance(ride.truth, PlaceLog)
        ]

    def close(self) -> None:
        """Finish the logs."""
        for seat in self._seats:
            seat.close()
        for ride in self._rides.values():
            if isinstance(ride.truth, TruthLog):
                ride.truth.close()


class _Ride:
    """One vehicle, and the link on which it and its coordinator hear one another."""

    def __init__(self, config: VehicleConfig, folder: Path | None) -> None:
        self.vehicle = Vehicle(config)
        self.truth = TruthLog(folder, config, self.vehicle.robot) if folder else PlaceLog()
        self.sent = b""  # by the vehicle in this tick
        self.traffic = bytearray()  # of both, as it passed
        self._waiting: tuple[bytes, ...] = ()
        self._link = self.vehicle.converse(channel=None)
        if folder:
            values = {entry.parameter.name: entry.value for entry in self.vehicle.parameters}
            files.write(folder / "parameters.param", values)

    def advance(self, until_us: int) -> None:
        """Let the vehicle hear what waits for it, and live until `until_us`."""
        heard, self._waiting = self._waiting, ()
        self.sent = b"".join(advance(self.vehicle, self._link, heard, until_us, self.truth))
        self.traffic += self.sent

    def hear(self, data: bytes) -> None:
        """Take in what the coordinator sends; the vehicle gets it when time goes on."""
        if data:
            self._waiting = (data,)
            self.traffic += data
