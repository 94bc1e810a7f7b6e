"""Messages that no decent ground station would send, drawn from one seed."""

import random
from collections.abc import Iterator
from math import inf, nan
from typing import Any

from mavherd.transport.mavlink import Message, mav
from mavherd.vehicles.protocol.commands import LINK_COMMANDS
from mavherd.vehicles.protocol.flight_commands import FLIGHT_COMMANDS
from mavherd.vehicles.vehicle import Vehicle

_BITS = {f"{sign}int{n}_t": (sign, n) for sign in ("", "u") for n in (8, 16, 32, 64)}
_LARGEST = 3.4028234663852886e38  # of a float
_ODD = (nan, inf, -inf, _LARGEST, -_LARGEST, 1e-45, -0.0, 0.0, 1.0, -1.0, 21196.0, 1e9, -1e9)
_COMMANDS = sorted({*FLIGHT_COMMANDS, *LINK_COMMANDS})
_LIKELY = 0.8
_STEERING = [
    *("COMMAND_LONG", "COMMAND_INT", "SET_MODE", "PARAM_SET", "MANUAL_CONTROL", "MISSION_COUNT"),
    *("SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT", "SET_ATTITUDE_TARGET"),
    *("MISSION_ITEM", "MISSION_ITEM_INT", "MISSION_SET_CURRENT", "RC_CHANNELS_OVERRIDE"),
]


class Vandal:
    """Draws messages of the whole dialect, most of them for `vehicle`; same seed, same messages."""

    def __init__(self, vehicle: Vehicle, seed: int) -> None:
        self.rng = random.Random(seed)
        self._vehicle = vehicle
        self._kinds = {kind.msgname: kind for kind in mav.mavlink_map.values()}
        self._all = sorted(self._kinds)
        self._heeded = sorted(vehicle.converse().heeds & set(self._all))
        self._parameters = [entry.parameter.name for entry in vehicle.parameters]

    def messages(self, count: int) -> Iterator[Message]:
        """Yield so many messages."""
        for _ in range(count):
            names = self.rng.choices((_STEERING, self._heeded, self._all), (6, 3, 1))[0]
            yield self.message(self.rng.choice(names))

    def message(self, name: str) -> Message:
        """Return a message with random fields: extremes, nonsense, and values that may pass."""
        kind = self._kinds[name]
        fields = {
            field: self._value(name, field, wire, length)
            for field, wire, length in zip(
                kind.fieldnames, kind.fieldtypes, _lengths(kind), strict=True
            )
        }
        return kind(**fields)

    def junk(self) -> bytes:
        """Return bytes of which some look like frames."""
        data = self.rng.randbytes(self.rng.randrange(1, 300))
        return self.rng.choice((b"", b"\xfd", b"\xfe", b"\xfd\x09\x00\x00", b"\xfe\x09")) + data

    def _value(self, name: str, field: str, wire: str, length: int) -> Any:
        rng = self.rng
        if rng.random() < _LIKELY and (sensible := self._sensible(name, field)) is not None:
            return sensible
        if wire == "char":
            return rng.randbytes(length)
        values = [self._number(wire) for _ in range(length or 1)]
        return values if length else values[0]

    def _number(self, wire: str) -> float | int:
        rng = self.rng
        if wire in ("float", "double"):
            return rng.choice(_ODD) if rng.random() < 0.5 else rng.uniform(-30, 30)
        sign, bits = _BITS[wire]
        low, high = (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        usual = rng.randrange(0, 20)
        return rng.choice((low, high, high - 1, 0, 1, rng.randint(low, high), usual, usual))

    def _sensible(self, name: str, field: str) -> Any:
        """Return a value that gets a message past the first checks, None where any may do."""
        rng, config, modes = self.rng, self._vehicle.config, self._vehicle.autopilot.modes
        match field:
            case "target_system" | "target":
                return config.system_id
            case "target_component":
                return rng.choice((0, 1))
            case "command" if name.startswith("COMMAND"):
                return rng.choice(_COMMANDS)
            case "custom_mode" if name == "SET_MODE":
                return modes.number(rng.choice(list(modes.rows)))
            case "base_mode":
                return mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
            case "param_id":
                return rng.choice(self._parameters).encode()
            case "coordinate_frame" | "frame":
                return rng.choice((0, 1, 3, 6, 7, 8, 9, 11))
            case "type_mask" if "POSITION" in name:
                return rng.choice((0xDF8, 0xDC7, 0xDC0, 0x9F8, 0x5C7, 0xC3F, 0x000, 0xE38))
            case "mission_type":
                return rng.choice((0, 1, 2))
            case "seq" | "count" | "start_index" | "end_index" if name.startswith("MISSION"):
                return rng.randrange(4)
        return None


def _lengths(kind: Any) -> list[int]:
    """Return the array lengths in the order of `fieldnames`."""
    by_name = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    return [by_name[name] for name in kind.fieldnames]
