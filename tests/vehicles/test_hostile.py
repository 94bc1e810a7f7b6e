"""Whatever peers say, a vehicle goes on: no exception, no NaN, no growth, no lost determinism."""

import gc
import random
from collections.abc import Iterator
from itertools import cycle
from math import inf, isfinite, nan
from typing import Any

import pytest

from mavherd.transport.mavlink import Codec, Message, mav
from mavherd.vehicles.config import AUTOPILOTS, KINDS, VehicleConfig
from mavherd.vehicles.missions.plan import Plan
from mavherd.vehicles.missions.waypoints import parse_wpl
from mavherd.vehicles.protocol.commands import LINK_COMMANDS
from mavherd.vehicles.protocol.flight_commands import FLIGHT_COMMANDS
from mavherd.vehicles.protocol.ftp import Packet
from mavherd.vehicles.vehicle import Vehicle

SYSTEM_ID = 3
EVERY = [(kind, stack) for kind in KINDS for stack in AUTOPILOTS]

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


class Arena:
    """A vehicle with a coordinator's link and two links of peers that mean no good."""

    def __init__(self, kind, stack, seed, profile="ardupilot"):
        config = VehicleConfig(kind=kind, system_id=SYSTEM_ID, autopilot=stack, profile=profile)
        self.vehicle = Vehicle(config)
        self.vandal = Vandal(self.vehicle, seed)
        self.own = self.vehicle.converse(channel=None)
        self.links = [self.vehicle.converse(channel=n) for n in range(2)]
        self.codecs = [Codec(255, 190), Codec(66, 0)]
        self.sent = [b"", b"", b""]  # by the vehicle: to the coordinator, and to the others

    @property
    def autopilot(self):
        return self.vehicle.autopilot  # a reboot makes a new one

    def rage(self, count, slices=(0, 0, 0, 1, 3, 20)):
        """Say so many things, time passing now and then."""
        rng = self.vandal.rng
        for message in self.vandal.messages(count):
            n = rng.randrange(2)
            data = self.codecs[n].encode([message])
            self.sent[n + 1] += self.vehicle.handle(data, self.links[n])
            self.run(rng.choice(slices))

    def run(self, slices):
        """Let time pass; everything must stay finite."""
        for _ in range(slices):
            self.vehicle.step()
            news = self.vehicle.take_broadcasts()
            for n, link in enumerate((self.own, *self.links)):
                self.sent[n] += self.vehicle.report(link, news)
            robot = self.vehicle.robot
            assert all(map(isfinite, (*robot.kinematics(), *robot.actuators())))

    def every_message(self):
        """Have the vehicle make every message that it has, as the wire carries it."""
        for message_id in self.vehicle.telemetry.ids:
            Codec(SYSTEM_ID).encode(self.vehicle.telemetry.request(message_id))


@pytest.mark.parametrize(("kind", "stack"), EVERY)
def test_nothing_said_in_any_mode_raises_or_makes_nan(kind, stack):
    arena = Arena(kind, stack, seed=1)
    for mode in arena.autopilot.modes.rows:
        arena.autopilot.arming.arm(force=True)
        if arena.autopilot.flies:
            arena.autopilot.take_off(5.0)
            arena.run(150)
        arena.autopilot.change_mode(mode)
        arena.rage(150)
        arena.every_message()


@pytest.mark.parametrize(("kind", "stack"), EVERY)
def test_the_same_abuse_has_the_same_answers(kind, stack):
    def sent():
        arena = Arena(kind, stack, seed=2, profile="default")
        arena.autopilot.arming.arm(force=True)
        arena.rage(400)
        return arena.sent

    first = sent()
    assert first == sent()
    assert all(first)


@pytest.mark.parametrize("kind", KINDS)
def test_bytes_that_mean_nothing_are_no_trouble(kind):
    arena = Arena(kind, "ardupilot", seed=3)
    for stream in (True, False):
        for _ in range(1500):
            arena.vehicle.handle(arena.vandal.junk(), arena.links[0], stream=stream)
    assert len(arena.links[0].codec._buffer) < 300  # what may still become a frame
    arena.run(100)
    assert not arena.autopilot.armed
    beat = mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    good = arena.codecs[0].encode([beat] * 3)
    arena.vehicle.handle(good * 100, arena.links[0])
    assert arena.links[0].spoken


def test_a_flood_leaves_nothing_behind():
    arena = Arena("quadcopter", "ardupilot", seed=4)
    for name in arena.vandal._all:  # how each is packed and read is learnt once
        data = arena.codecs[0].encode([arena.vandal.message(name)])
        arena.sent[1] += arena.vehicle.handle(data, arena.links[0])
    arena.every_message()
    sizes = []
    for _ in range(4):
        arena.rage(1200, slices=(0, 0, 0, 0, 0, 1))  # more than is ever taken off our hands
        arena.run(50)
        arena.sent = [b"", b"", b""]
        gc.collect()
        sizes.append(len(gc.get_objects()))
    assert sizes[-1] - sizes[0] < 500, sizes


def test_a_flood_between_two_slices_makes_few_messages():
    arena = Arena("quadcopter", "ardupilot", seed=5)
    arena.rage(3000, slices=(0,))
    assert len(arena.vehicle.take_broadcasts()) < 200


WAYPOINTS = "QGC WPL 110\n" + "".join(
    f"{i}\t0\t3\t16\t0\t0\t0\t0\t47.3977\t{8.5456 + i / 1e5:.5f}\t10\t1\n" for i in range(30)
)


class Station:
    """Gets parameters, mission and a file over one link, each in its own session at once."""

    def __init__(self, vehicle, system_id):
        self.codec, self.link = Codec(system_id, 190), vehicle.converse(spoken=True)
        self.parameters, self.items, self.file = {}, {}, b""
        self.count = self.size = 0  # of the mission, and of the file
        self._vehicle = vehicle
        self._session = system_id % 5
        self._to = SYSTEM_ID, 1
        self.say(mav.MAVLink_param_request_list_message(*self._to))
        self.say(mav.MAVLink_mission_request_list_message(*self._to))
        path = b"@PARAM/param.pck"
        self._ftp(mav.MAV_FTP_OPCODE_OPENFILERO, size=len(path), data=path)

    def say(self, message):
        self.hear(self._vehicle.handle(self.codec.encode([message]), self.link))

    def hear(self, data):
        for m in self.codec.decode(data):
            match m.get_type():
                case "PARAM_VALUE":
                    self.parameters[m.param_index] = m.param_id
                case "MISSION_COUNT":
                    self.count = m.count
                    self._ask(0)
                case "MISSION_ITEM_INT":
                    self.items[m.seq] = m.y
                    if m.seq + 1 < self.count:
                        self._ask(m.seq + 1)
                case "FILE_TRANSFER_PROTOCOL":
                    self._on_file(Packet.unpack(bytes(m.payload)))

    def _ask(self, seq):
        self.say(mav.MAVLink_mission_request_int_message(*self._to, seq))

    def _ftp(self, opcode, **more):
        packet = Packet(sequence=1, session=self._session, opcode=opcode, **{"size": 0, **more})
        payload = list(packet.pack())
        self.say(mav.MAVLink_file_transfer_protocol_message(0, *self._to, payload))

    def _on_file(self, answer):
        if answer.opcode != mav.MAV_FTP_OPCODE_ACK:
            return
        if answer.req_opcode == mav.MAV_FTP_OPCODE_OPENFILERO:
            self.size = int.from_bytes(answer.data[:4], "little")
        else:
            self.file += answer.data[: answer.size]
        if len(self.file) < self.size:
            self._ftp(mav.MAV_FTP_OPCODE_READFILE, size=200, offset=len(self.file))


def test_sessions_of_several_links_do_not_mix():
    vehicle = Vehicle(VehicleConfig(kind="quadcopter", system_id=SYSTEM_ID))
    plan = parse_wpl(WAYPOINTS, "field")
    assert isinstance(plan, Plan)
    vehicle.missions.load(plan, "field")
    vandal, noisy = Vandal(vehicle, 6), vehicle.converse(spoken=True)
    pack = vehicle.files.read("@PARAM/param.pck")  # STAT_RUNTIME will change
    stations = [Station(vehicle, system_id) for system_id in (255, 245, 7)]
    turns = cycle(stations)
    for _ in range(300):
        vehicle.handle(vandal.junk(), noisy)
        vehicle.step()
        news = vehicle.take_broadcasts()
        for _ in stations:
            station = next(turns)
            station.hear(vehicle.report(station.link, news))
        next(turns)  # another one is the first now
    names = [entry.parameter.name for entry in vehicle.parameters]
    for station in stations:
        assert [station.parameters[i] for i in range(len(names))] == names
        assert sorted(station.items) == list(range(station.count))
        assert station.count == 30
        assert station.file == pack
