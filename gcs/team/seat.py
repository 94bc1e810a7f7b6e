"""One coordinator with its logs and its part of the bus, whatever carries the bytes."""

from collections.abc import Sequence
from pathlib import Path

from ...scenarios.schema import Scenario
from ...transport.bus import Bus
from ...transport.local_bus import LocalBus
from ...transport.tlog import TlogWriter
from ...transport.wire import VehicleState
from .coordinator import Coordinator, MakeConduct
from .exchange import Exchange
from .mission import Mission


class Seat:
    """A `Coordinator` of the vehicles `own`, and what it shares and writes down.

    Its tlogs are dated `epoch_us` plus fleet time; without a `folder` it writes none. A tick is
    `offer`, for every coordinator of the team, and then `decide`.
    """

    def __init__(
        self,
        scenario: Scenario,
        own: Sequence[str],
        bus: Bus | LocalBus,
        *,
        lockstep: bool,
        folder: Path | None,
        epoch_us: int,
        conduct: MakeConduct = Mission,
        strict: bool = True,
    ) -> None:
        self._tlogs = {}
        if folder:
            self._tlogs = {
                name: TlogWriter(folder / "vehicles" / name / f"{name}.tlog") for name in own
            }
        taps = {
            name: lambda frame, now, log=log: log.write(epoch_us + round(now * 1e6), frame)
            for name, log in self._tlogs.items()
        }
        self.core = Coordinator(scenario, tuple(own), taps, conduct, strict=strict)
        self.exchange = Exchange(self.core, bus, lockstep=lockstep)

    def offer(self, now: float) -> None:
        """Begin a tick: let the others know the states of our vehicles."""
        self.exchange.offer(now)

    def decide(self, now: float) -> dict[str, bytes]:
        """Return what each of our vehicles is to get, knowing the states of all."""
        states: list[VehicleState] = self.exchange.gather(now)
        sent = self.core.tick(now, states)
        self.exchange.publish_targets()
        return sent

    def close(self) -> None:
        """Finish the logs."""
        for log in self._tlogs.values():
            log.close()
