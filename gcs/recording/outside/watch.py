"""Records outside vehicles as they turn up, from the messages that somebody hears."""

from collections.abc import Callable, Sequence
from typing import Any

from ....transport.frames import Origin, Triple
from ....transport.mavlink import AUTOPILOT_COMPONENT, Message, mav
from ....transport.wire import Target
from ..scene import Layout, Scene
from ..stage import Stage, StagedRobot
from ..stream import Stream
from .instruments import Instruments
from .layout import AIMED, PLACED, TURNED, outside_layout
from .place import to_enu
from .tracks import PATIENCE_OF_MANY_S, PATIENCE_S, TrackMaker
from .vehicle import SILENT_S, SeenVehicle

_ORDERS = frozenset(("SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT"))
_UNKNOWN = Origin(0.0, 0.0, 0.0)  # on a map: nowhere
_ZERO: Triple = (0.0, 0.0, 0.0)
_NAN: Triple = (float("nan"),) * 3

Event = dict[str, Any]


class Outside:
    """Writes one recording of vehicles that nobody here has started.

    Times are seconds of the recording. A vehicle is what sends heartbeats of an autopilot; of two
    places at which one system id is heard the first counts, until it is silent. `tell` gets every
    event as it is recorded. If nobody looks on `live`, the views are laid out once, at the end.
    """

    def __init__(
        self,
        stream: Stream,
        title: str,
        tell: Callable[[Event], None] | None = None,
        *,
        live: bool = True,
    ) -> None:
        self.vehicles: dict[int, SeenVehicle] = {}
        self._makers: dict[int, TrackMaker] = {}
        self._staged: set[int] = set()
        self._aimed: set[int] = set()  # of which is known where they should be
        self._doubled: set[int] = set()
        self._stream = stream
        self._tell = tell
        self._lay_out: Layout = outside_layout if live else _later
        self._origin: Origin | None = None
        self._scene = Scene(stream, Stage(title, "", (), _UNKNOWN), lay_out=self._lay_out)
        self._instruments = Instruments(stream)

    def hear(self, m: Message, source: str, now: float) -> None:
        """Take in a message that arrives at `now` from `source`."""
        system = m.get_srcSystem()
        if m.get_type() in _ORDERS:
            if vehicle := self.vehicles.get(m.target_system):
                vehicle.hear_order(m, now)
            return
        if m.get_srcComponent() != AUTOPILOT_COMPONENT:
            return
        vehicle = self.vehicles.get(system)
        beats = m.get_type() == "HEARTBEAT"
        if beats and (m.type == mav.MAV_TYPE_GCS or m.autopilot == mav.MAV_AUTOPILOT_INVALID):
            return
        if vehicle is None:
            if beats:
                vehicle = self.vehicles[system] = SeenVehicle(system, m, source, now)
                self._makers[system] = TrackMaker(vehicle)
                vehicle.hear(m, now)
            return
        if vehicle.source != source:
            if now - vehicle.heard_at <= SILENT_S:
                if beats:
                    self._complain(vehicle, source, now)
                return
            vehicle.source = source
        vehicle.hear(m, now)

    def look(self, now: float) -> None:
        """Note how the links are, between two batches that are long apart."""
        for vehicle in self.vehicles.values():
            vehicle.watch(now)
            self._instruments.look(vehicle, now)

    def flush(self, now: float, *, everything: bool = False) -> None:
        """Record what is known by `now`."""
        self.look(now)
        self._settle_origin(now)
        patience = PATIENCE_S if len(self.vehicles) == 1 else PATIENCE_OF_MANY_S
        for system, vehicle in self.vehicles.items():
            maker = self._makers[system]
            late = system in self._staged or everything or now - vehicle.first_at > patience
            maker.locate(self._origin, late=late)
            self._record_events(vehicle)
            if system not in self._staged:
                if maker.place is None and not late:
                    continue
                self._enter(vehicle, maker.place, now)
            self._record(vehicle, maker, now, everything=everything)
        self._scene.flush(everything=everything)

    def close(self, now: float) -> None:
        """Record the rest and end the recording."""
        try:
            self.flush(now, everything=True)
            self._step_back()
        finally:
            self._stream.close()

    def _step_back(self) -> None:
        """Lay the views out again: all places of the vehicles are in sight, no plot is empty."""
        stage = self._scene.stage
        robots = (r._replace(path=self._makers[r.system_id].corners) for r in stage.robots)
        told = {robot.name: self._told(robot.system_id) for robot in stage.robots}
        self._stream.blueprint(outside_layout(stage._replace(robots=tuple(robots)), told=told))

    def _told(self, system: int) -> set[str]:
        """Return what is recorded of a vehicle, as its layout takes it."""
        vehicle, is_placed = self.vehicles[system], self._makers[system].place is not None
        return {
            *self._instruments.told[vehicle.name],
            *(PLACED if is_placed else ()),
            *(TURNED if vehicle.attitudes.last else ()),
            *(AIMED if is_placed and system in self._aimed else ()),
        }

    def _settle_origin(self, now: float) -> None:
        """Begin the shared frame where the first vehicle that knows it begins its own."""
        if self._origin is not None:
            return
        marks = (v.frame.landmark(now) for v in self.vehicles.values())
        self._origin = next((mark for mark in marks if mark), None)
        if self._origin is not None:  # a scene knows its origin from the beginning
            self._scene.flush(everything=True)
            stage = self._scene.stage._replace(origin=self._origin)
            self._scene = Scene(self._stream, stage, lay_out=self._lay_out)

    def _enter(self, vehicle: SeenVehicle, place: Triple | None, now: float) -> None:
        here = place or _ZERO
        system, kind = vehicle.system_id, vehicle.kind
        robot = StagedRobot(vehicle.name, kind, system, here, None, external=True)
        self._staged.add(vehicle.system_id)
        self._scene.add_robot(robot)
        self._instruments.add_robot(robot)
        if place is None:
            vehicle.events.append(_event(vehicle, now, "tells no position: shown at the origin"))
            self._record_events(vehicle)

    def _record(
        self, vehicle: SeenVehicle, maker: TrackMaker, now: float, *, everything: bool
    ) -> None:
        if (track := maker.take(everything=everything)) is not None:
            self._scene.add_truth(track)
        if targets := self._targets(vehicle):
            self._scene.add_targets(targets)
        for time, mode in vehicle.modes:
            self._scene.add_mode(vehicle.name, time, mode)
        vehicle.modes.clear()
        self._instruments.record(vehicle, now, everything=everything)

    def _record_events(self, vehicle: SeenVehicle) -> None:
        for event in vehicle.events:
            self._scene.add_event(event)
            if self._tell:
                self._tell(event)
        vehicle.events.clear()

    def _targets(self, vehicle: SeenVehicle) -> list[Target]:
        own = vehicle.frame.origin
        targets = []
        for time, spot, velocity in vehicle.wanted:
            place = to_enu(spot, own, self._origin) if spot else None
            if place:
                self._aimed.add(vehicle.system_id)
            v = velocity or _NAN
            targets.append(Target(vehicle.name, time, place or _NAN, v, v, _ZERO))
        vehicle.wanted.clear()
        return targets

    def _complain(self, vehicle: SeenVehicle, source: str, now: float) -> None:
        if vehicle.system_id not in self._doubled:
            self._doubled.add(vehicle.system_id)
            text = (
                f"system {vehicle.system_id} is heard at {vehicle.source} and {source}; only the "
                "first is shown (two vehicles? give each its own: SYSID_THISMAV or MAV_SYS_ID)"
            )
            vehicle.events.append(_event(vehicle, now, text))


def _later(_: Stage, __: Sequence[str]) -> None:
    """Lay out nothing yet."""


def _event(vehicle: SeenVehicle, now: float, text: str) -> Event:
    severity = mav.MAV_SEVERITY_WARNING
    return {
        "t": now,
        "vehicle": vehicle.name,
        "kind": "problem",
        "text": text,
        "severity": severity,
    }
