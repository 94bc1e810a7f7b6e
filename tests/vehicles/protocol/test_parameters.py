"""The parameter protocol: list, read, set; integers as numbers or as bits; floods stay cheap."""

import struct

import pytest

from mavherd.transport.errors import MavherdError
from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.parameters.store import Parameters
from mavherd.vehicles.protocol.parameters import HASH_CHECK, ParameterService, checksum

INT8, INT32, UINT32, REAL32 = 2, 6, 5, 9


class Desk:
    """One service, what it broadcasts and says, and messages that have gone over the wire."""

    def __init__(self, kind="quadcopter", autopilot="ardupilot", **params):
        self.parameters = Parameters(
            VehicleConfig(kind=kind, system_id=7, autopilot=autopilot, params=params)
        )
        self.broadcasts, self.texts, self.banners = [], [], 0
        self.ground, self.vehicle = Codec(255, 190), Codec(7)
        self.now = 0.0
        self.service = ParameterService(
            self.parameters,
            self.broadcasts.append,
            self.texts.append,
            bytewise=autopilot == "px4",
            on_list=self.announce,
        )

    def announce(self):
        self.banners += 1

    def send(self, *messages):
        replies = []
        for m in self.vehicle.decode(self.ground.encode(messages)):
            replies += self.service.handlers[m.get_type()](m)
        return self.received(replies)

    def received(self, messages):
        return self.ground.decode(self.vehicle.encode(messages))

    def due(self):
        self.now += 0.01
        return self.received(self.service.due(self.now))

    def list(self):
        self.send(ask_list())
        return self.rest()

    def rest(self):
        out = []
        while values := self.due():
            assert len(values) <= 30
            out += values
        return out

    def set(self, name, value, type_=REAL32):
        """Set and return the echo: what is broadcast, or else what is replied."""
        replies = self.send(mav.MAVLink_param_set_message(7, 1, name.encode(), value, type_))
        echoes, self.broadcasts[:] = self.received(self.broadcasts), []
        assert len(replies) + len(echoes) <= 1
        return (echoes, replies)

    def read(self, name="", index=-1):
        name = name if isinstance(name, bytes) else name.encode()
        return self.send(mav.MAVLink_param_request_read_message(7, 1, name, index))


def ask_list():
    return mav.MAVLink_param_request_list_message(7, 1)


def as_int(m):
    return struct.unpack("<i", struct.pack("<f", m.param_value))[0]


@pytest.fixture
def desk():
    return Desk()


def test_the_list_is_paced_and_whole(desk):
    values = desk.list()
    assert [m.param_index for m in values] == list(range(len(desk.parameters)))
    assert {m.param_count for m in values} == {len(desk.parameters)}
    for m, (_, parameter, value, _) in zip(values, desk.parameters, strict=True):
        assert (m.param_id, m.param_type, m.param_value) == (parameter.name, parameter.type, value)
    assert values[0].param_id == "FORMAT_VERSION"
    assert desk.due() == []


def test_a_repeated_request_begins_anew(desk):
    desk.send(ask_list())
    desk.due()
    desk.due()
    assert desk.list()[0].param_index == 0
    assert desk.banners == 1  # said once in a second
    desk.now += 1.0
    desk.due()
    desk.send(ask_list())
    assert desk.banners == 2


def test_reading_by_name_and_by_index(desk):
    (by_name,) = desk.read("RTL_ALT")
    assert (by_name.param_value, by_name.param_type) == (1500, INT32)
    (by_index,) = desk.read(index=by_name.param_index)
    assert by_index.to_dict() == by_name.to_dict()
    (ignored_name,) = desk.read("LAND_SPEED", by_name.param_index)
    assert ignored_name.param_id == "RTL_ALT"


@pytest.mark.parametrize("name", ["NO_SUCH", "", "rtl_alt", HASH_CHECK, b"\xff\xfe", b"RTL_ALT\0X"])
def test_what_does_not_exist_is_met_with_silence(desk, name):
    replies = desk.read(name)
    assert [m.param_id for m in replies] == (["RTL_ALT"] if name == b"RTL_ALT\0X" else [])
    if not replies and isinstance(name, str):
        assert desk.set(name, 1) == ([], [])
    assert desk.read(index=len(desk.parameters)) == desk.read(index=32767) == []
    assert desk.read(index=-2) == []


def test_names_of_sixteen_characters_have_no_nul(desk):
    (m,) = desk.read("HERD_THRUST_COEF")
    assert m.param_id == "HERD_THRUST_COEF"
    assert m.param_value == pytest.approx(8.54858e-6)
    echoes, _ = desk.set("RC_OVERRIDE_TIME", 2.5)
    assert echoes[0].param_value == 2.5


def test_a_set_counts_and_everybody_hears_it(desk):
    (echo,), replies = desk.set("RTL_ALT", 2000.0, INT32)
    assert (echo.param_id, echo.param_value, echo.param_type) == ("RTL_ALT", 2000, INT32)
    assert echo.param_count == len(desk.parameters)
    assert desk.parameters.settings.rtl_height == 20
    assert (replies, desk.texts) == ([], [])


def test_an_equal_value_is_echoed_too(desk):
    assert desk.set("RTL_ALT", 1500.0)[0][0].param_value == 1500


def test_a_float_sent_to_an_integer_is_cut_off(desk):  # DroneKit calls everything a float
    (echo,), _ = desk.set("RTL_ALT", 1234.6, REAL32)
    assert (echo.param_value, echo.param_type) == (1234, INT32)


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("RTL_ALT", float("nan"), "RTL_ALT: nan is not a number to set"),
        ("RTL_ALT", float("inf"), "RTL_ALT: inf is not a number to set"),
        ("RTL_ALT", -1.0, "RTL_ALT: -1 is not within 0 to 300000 cm"),
        ("FRAME_CLASS", 2.0, "FRAME_CLASS is read-only"),
        ("FENCE_ACTION", 3.0, "FENCE_ACTION: 3 is not supported"),
    ],
)
def test_a_refused_set_is_answered_with_the_old_value_and_the_reason(desk, name, value, why):
    old = desk.parameters[name]
    echoes, (reply,) = desk.set(name, value)
    assert echoes == []
    assert (reply.param_id, reply.param_value) == (name, old)
    assert desk.texts[0].startswith(why)
    assert desk.parameters[name] == old


def test_a_value_that_cannot_be_kept_counts_and_says_so(desk):
    def full():
        raise MavherdError("parameters.param: cannot be written: the disk is full")

    desk.parameters.on_change = full
    (echo,), _ = desk.set("RTL_ALT", 2000)
    assert echo.param_value == 2000
    assert desk.texts == ["parameters.param: cannot be written: the disk is full"]


def test_a_flood_is_cheap_and_ends_with_its_slice(desk):
    asked = [mav.MAVLink_param_request_read_message(7, 1, b"RTL_ALT", -1)] * 500
    assert 50 <= len(desk.send(*asked)) <= 100, "a whole page of a ground station, no more"
    sets = [
        mav.MAVLink_param_set_message(7, 1, b"RTL_ALT", 2000 + i % 2, REAL32) for i in range(500)
    ]
    desk.send(*sets)
    assert len(desk.broadcasts) <= 100
    desk.send(*[ask_list()] * 500)
    assert desk.banners == 1
    assert len(desk.due()) <= 30
    assert len(desk.read("RTL_ALT")) == 1  # and then it answers again


def test_px4_sends_integers_as_bits_and_its_checksum_first():
    desk = Desk(autopilot="px4")
    first, *values = desk.list()
    assert (first.param_id, first.param_index, first.param_type) == (HASH_CHECK, 65535, UINT32)
    assert first.param_count == len(desk.parameters)
    assert as_int(first) & 0xFFFFFFFF == checksum(desk.parameters)
    assert [m.param_index for m in values] == list(range(len(desk.parameters)))
    for m, (_, parameter, value, _) in zip(values, desk.parameters, strict=True):
        assert m.param_type == parameter.type
        assert (as_int(m) if m.param_type == INT32 else m.param_value) == value


@pytest.mark.parametrize("number", [3, 0])
def test_px4_takes_integers_as_bits(number):
    desk = Desk(autopilot="px4")
    bits = struct.unpack("<f", struct.pack("<i", number))[0]
    (echo,), _ = desk.set("NAV_DLL_ACT", bits, INT32)
    assert as_int(echo) == number == desk.parameters["NAV_DLL_ACT"]


def test_px4_takes_negative_and_small_integers_and_plain_floats():
    desk = Desk(autopilot="px4")
    for number, form, type_ in ((-1, "<i", INT32), (-1, "<bxxx", INT8)):
        bits = struct.unpack("<f", struct.pack(form, number))[0]
        (echo,), _ = desk.set("COM_FLTMODE1", bits, type_)
        assert as_int(echo) == number
    (echo,), _ = desk.set("COM_FLTMODE1", 4.0, REAL32)
    assert as_int(echo) == 4
    (echo,), _ = desk.set("MIS_TAKEOFF_ALT", 7.5, REAL32)
    assert echo.param_value == 7.5


def test_px4_refuses_the_bits_of_an_integer_for_a_float():
    desk = Desk(autopilot="px4")
    before = desk.parameters["MIS_TAKEOFF_ALT"]
    told, (old,) = desk.set("MIS_TAKEOFF_ALT", struct.unpack("<f", struct.pack("<i", 3))[0], INT32)
    assert told == []
    assert old.param_value == before == desk.parameters["MIS_TAKEOFF_ALT"]


def test_px4s_checksum_knows_every_change_but_those_of_the_vehicle():
    desk = Desk(autopilot="px4")
    before = checksum(desk.parameters)
    desk.parameters.follow("MAV_SYS_ID", lambda: 9)
    assert checksum(desk.parameters) == before
    desk.set("MIS_TAKEOFF_ALT", 7.5)
    assert checksum(desk.parameters) != before
    (m,) = desk.read(HASH_CHECK)
    assert as_int(m) & 0xFFFFFFFF == checksum(desk.parameters)


def test_a_station_that_knows_the_checksum_ends_the_list():
    desk = Desk(autopilot="px4")
    desk.send(ask_list())
    desk.due()
    assert desk.set(HASH_CHECK, 0.0, UINT32) == ([], [])
    assert desk.due() == []
