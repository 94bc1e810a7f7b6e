"""The parameters of one vehicle with their values: read, checked, set, and put to use at once."""

from collections.abc import Callable, Iterator, Mapping
from difflib import get_close_matches
from typing import NamedTuple

from ..config import VehicleConfig
from ..flight.settings import Settings
from ..robot import Robot
from .overrides import built, in_our_units
from .parameter import Parameter, ParameterRefused
from .profile import numbers
from .settings_path import read, write
from .tables import PRESETS, SYSTEM_IDS, Facts, facts


class Entry(NamedTuple):
    """A parameter with its place in the list and its value, as clients see them."""

    place: int
    parameter: Parameter
    value: float
    default: float


class Parameters:
    """Every parameter of one vehicle, in a fixed order; their number never changes.

    `config.params` are overrides: MAVLink names in wire units or names of ours in SI units.
    Fields of `settings` that are not at their usual value stay as they are and become the
    parameter's default. Raises ValueError for overrides that cannot be.
    """

    def __init__(self, config: VehicleConfig, settings: Settings | None = None) -> None:
        self.settings = Settings() if settings is None else settings
        self.on_change: Callable[[], None] | None = None
        """Called after a user's change; it may raise MavherdError, which `set` lets through."""
        self._kind, self._profile = config.kind, config.profile
        self._robot: Robot | None = None
        known = facts(config.autopilot, config.kind, config.profile)
        self._table, self._index = known.table, known.places
        self._usual = numbers(config.kind, config.profile)
        self._defaults = self._first_values(known, PRESETS.get(config.autopilot, {}))
        for name in SYSTEM_IDS:
            if name in self._index:
                self._defaults[self._index[name]] = float(config.system_id)
        self._values = list(self._defaults)
        self._ours = in_our_units(config.kind, config.autopilot, config.profile, config.params)
        given = {index for name in config.params if (index := self._index.get(name)) is not None}
        for index in sorted(given.union(known.robots)):
            parameter = self._table[index]
            if parameter.is_robots and parameter.robot_name in self._ours:
                self._values[index] = parameter.to_wire(self._ours[parameter.robot_name])
            elif index in given:
                self._put(index, parameter.stored(config.params[parameter.name]))
        self._start = list(self._values)
        self._touched: set[str] = set()
        self._sources: dict[int, Callable[[], float]] = {}

    def bind(self, robot: Robot) -> None:
        """Tune `robot` from now on; it must have been built with `robot_overrides`."""
        self._robot = robot

    @property
    def robot_overrides(self) -> dict[str, float]:
        """Return the gains and constants that are not usual, by name, SI: for `make_robot`."""
        return dict(self._ours)

    def __len__(self) -> int:
        return len(self._table)

    def __iter__(self) -> Iterator[Entry]:
        return map(self.at, range(len(self._table)))

    def __contains__(self, name: object) -> bool:
        return name in self._index

    def __getitem__(self, name: str) -> float:
        return self.entry(name).value

    def at(self, place: int) -> Entry:
        """Return the parameter at a place of the list; raise IndexError."""
        if place < 0:
            raise IndexError(place)
        parameter, value = self._table[place], self._values[place]
        if source := self._sources.get(place):
            value = parameter.stored(min(parameter.high, max(parameter.low, source())))
        return Entry(place, parameter, value, self._defaults[place])

    def entry(self, name: str) -> Entry:
        """Return the parameter with a name; raise KeyError."""
        return self.at(self._index[name])

    def set(self, name: str, value: float) -> Entry:
        """Set a parameter, as its type can keep it, and put it to use; raise ParameterRefused."""
        stored = self._acceptable(name, value)
        index = self._index[name]
        if stored != self._values[index]:
            if self._table[index].is_robots:
                self._tune(index, stored)
            self._put(index, stored)
            self._touched.add(name)
            if self.on_change is not None:
                self.on_change()
        return self.at(index)

    def follow(self, name: str, source: Callable[[], float]) -> None:
        """Show what `source` says from now on, as of MIS_TOTAL; an unknown name is nobody's."""
        if name in self._index:
            self._sources[self._index[name]] = source

    def touched(self) -> dict[str, float]:
        """Return what users have set since the start, by name."""
        return {name: self[name] for name in self._index if name in self._touched}

    def is_usual(self, name: str) -> bool:
        """Return whether a parameter has its default, and had it at the start."""
        index = self._index[name]
        return self._values[index] == self._start[index] == self._defaults[index]

    def _first_values(self, known: Facts, presets: Mapping[str, object]) -> list[float]:
        """Return the defaults, and have the settings agree with them."""
        usual, values = Settings(), list(known.defaults)
        for path, meaning in presets.items():
            if read(self.settings, path) == read(usual, path):
                write(self.settings, path, meaning)
        for index, usually in known.settings:
            parameter = self._table[index]
            ours = read(self.settings, parameter.path)
            if ours != usually and parameter.path not in presets:
                values[index] = parameter.stored(parameter.to_wire(ours))
            elif ours != (meant := parameter.to_ours(parameter.default)):
                write(self.settings, parameter.path, meant)
        return values

    def _acceptable(self, name: str, value: float) -> float:
        index = self._index.get(name)
        if index is None:
            close = get_close_matches(name, self._index, n=1)
            hint = f" (did you mean {close[0]}?)" if close else ""
            raise ParameterRefused(f"unknown parameter {name}{hint}")
        parameter = self._table[index]
        if parameter.read_only:
            raise ParameterRefused(f"{name} is read-only")
        return parameter.stored(value)

    def _tune(self, index: int, value: float) -> None:
        """Give the robot a gain now, or the next one a constant, if it can fly with that."""
        parameter = self._table[index]
        name = parameter.robot_name
        ours = {key: number for key, number in self._ours.items() if key != name}
        number = self._usual[name]
        if value != parameter.default:
            ours[name] = number = value * parameter.scale
        try:
            built(self._kind, self._profile, ours)
            if self._robot is not None and not parameter.reboot:
                self._robot.retune(**{name: number})
        except ValueError as error:
            raise ParameterRefused(f"{parameter.name}: {error}") from None
        self._ours = ours

    def _put(self, index: int, value: float) -> None:
        parameter = self._table[index]
        self._values[index] = value
        if parameter.is_setting:
            write(self.settings, parameter.path, parameter.to_ours(value))
