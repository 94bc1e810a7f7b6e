"""What outside vehicles have beside a place: batteries, servos, and a link that lives."""

from collections import defaultdict
from math import inf

import numpy as np

from ..colours import next_colour
from ..stage import StagedRobot
from ..stream import Stream, rgb
from .vehicle import SeenVehicle, Value

_RATE_S = 1.0  # over which messages are counted
LOOK_S = 0.5  # between two looks at a link
_PERIOD_S = 2.0  # between batches: each has its cost in a file
_OUTPUTS = "#56B4E9", "#E69F00", "#00B386", "#CC79A7"  # told apart by everybody, on dark ground
ROOT = "telemetry"  # of the entities
PLOTS = {  # and their units
    "battery": "V",
    "charge": "%",
    "throttle": "%",
    "signal": "%",
    "servos": "us",
    "rates": "messages/s",
    "ages": "s",
}


class Instruments:
    """Writes the plots that only recordings of outside vehicles have."""

    def __init__(self, stream: Stream) -> None:
        import rerun as rr

        self._rr = rr
        self._stream = stream
        self._colours: dict[str, str] = {}
        self._counted: dict[str, tuple[float, int]] = {}
        self._due: dict[str, float] = {}
        self._looked: dict[str, float] = {}
        self.told: dict[str, set[str]] = {}  # which plots there are of each robot

    def add_robot(self, robot: StagedRobot) -> None:
        """Make room for a robot, in the order in which the scene is told of them."""
        self.told[robot.name] = set()
        self._colours[robot.name] = next_colour(robot, self._colours)
        colour = rgb(self._colours[robot.name])
        for plot in PLOTS:
            names: str | list[str] = robot.name
            if plot == "servos":
                names = [f"{robot.name} output {i}" for i in range(1, 5)]
                paints = [rgb(paint) for paint in _OUTPUTS]
                lines = self._rr.SeriesLines(names=names, colors=paints, widths=1.5)
            else:
                lines = self._rr.SeriesLines(names=names, colors=colour, widths=1.5)
            self._stream.static(f"{ROOT}/{plot}/{robot.name}", lines)

    def look(self, vehicle: SeenVehicle, now: float) -> None:
        """Note how its link is."""
        if now - self._looked.get(vehicle.name, -inf) >= LOOK_S:
            self._looked[vehicle.name] = now
            self._count(vehicle, now)
            vehicle.values.append(Value("ages", now, (now - vehicle.heard_at,)))

    def record(self, vehicle: SeenVehicle, now: float, *, everything: bool = False) -> None:
        """Record what is new of a vehicle, and how old it is."""
        self.look(vehicle, now)
        if now < self._due.get(vehicle.name, 0.0) and not everything:
            return
        self._due[vehicle.name] = now + _PERIOD_S
        grouped: dict[str, list[Value]] = defaultdict(list)
        for value in vehicle.values:
            grouped[value.plot].append(value)
        vehicle.values.clear()
        for plot, values in grouped.items():
            self._send(f"{ROOT}/{plot}/{vehicle.name}", values)
        self.told[vehicle.name].update(grouped)

    def _count(self, vehicle: SeenVehicle, now: float) -> None:
        since, before = self._counted.setdefault(vehicle.name, (now, vehicle.heard))
        if now - since >= _RATE_S:
            self._counted[vehicle.name] = now, vehicle.heard
            rate = (vehicle.heard - before) / (now - since)
            vehicle.values.append(Value("rates", now, (rate,)))

    def _send(self, entity: str, values: list[Value]) -> None:
        numbers = np.array([value.numbers for value in values])
        columns = self._rr.Scalars.columns(scalars=numbers.ravel())
        if numbers.shape[1] > 1:
            columns = columns.partition([numbers.shape[1]] * len(numbers))
        self._stream.columns(entity, np.array([value.time for value in values]), columns)
