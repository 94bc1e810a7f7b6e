"""Parameters are read and written by name in either encoding; silence and a no are errors."""

import struct

import pytest

from mavherd.gcs.station import RETRY_S, TRIES
from mavherd.transport.mavlink import mav

REAL, WHOLE = (
    {"ardupilot": "CRUISE_SPEED", "px4": "MIS_TAKEOFF_ALT"},
    {
        "ardupilot": "FENCE_ACTION",
        "px4": "NAV_DLL_ACT",
    },
)


def ready(make_pair, autopilot):
    kind = "rover" if autopilot == "ardupilot" else "quadcopter"
    pair = make_pair(kind, autopilot)
    pair.run(1)
    return pair


def sets(pair):
    return [m for _, m in pair.sent if m.get_type() == "PARAM_SET"]


def answer(pair, question):
    pair.until(lambda: question.done, RETRY_S * (TRIES + 2))
    return question


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize(("names", "value"), [(REAL, 3.5), (WHOLE, 2.0)])
def test_what_is_written_is_what_the_vehicle_has(make_pair, autopilot, names, value):
    pair = ready(make_pair, autopilot)
    name = names[autopilot]
    before = answer(pair, pair.station.parameters.read(name, pair.now))
    assert before.accepted
    assert before.value == pytest.approx(pair.vehicle.parameters.entry(name).value)
    assert before.value != value
    written = answer(pair, pair.station.parameters.write(name, value, pair.now))
    assert (written.accepted, written.value, written.error) == (True, value, "")
    assert pair.vehicle.parameters.entry(name).value == value


def test_no_answer_says_that_there_may_be_no_such_parameter(make_pair):
    pair = ready(make_pair, "ardupilot")
    question = answer(pair, pair.station.parameters.read("NO_SUCH_THING", pair.now))
    assert question.error == (
        "q: parameter NO_SUCH_THING: it has no parameter NO_SUCH_THING, or does not answer"
    )
    asked = [m for _, m in pair.sent if m.get_type() == "PARAM_REQUEST_READ"]
    assert len(asked) == TRIES


def test_a_lost_question_is_asked_again(make_pair):
    pair = ready(make_pair, "px4")
    pair.deaf = True
    question = pair.station.parameters.write("NAV_DLL_ACT", 2, pair.now)
    pair.run(RETRY_S * 2)
    pair.deaf = False
    assert answer(pair, question).accepted


def test_a_value_that_the_vehicle_refuses_is_an_error_with_its_reason(make_pair):
    pair = ready(make_pair, "ardupilot")
    question = answer(pair, pair.station.parameters.write("SYSID_THISMAV", 999, pair.now))
    assert question.refused
    assert "q: parameter SYSID_THISMAV = 999: refused: it stays 5" in question.error
    assert "the vehicle says" in question.error


def test_a_name_that_cannot_be_one_is_refused_here(make_pair):
    pair = ready(make_pair, "ardupilot")
    for name in ("", "A_NAME_THAT_IS_TOO_LONG", "HÖHE"):
        assert "cannot be the name" in pair.station.parameters.read(name, pair.now).error


def test_a_newer_question_takes_the_place_of_an_older_one(make_pair):
    pair = ready(make_pair, "ardupilot")
    older = pair.station.parameters.write("CRUISE_SPEED", 1.5, pair.now)
    newer = pair.station.parameters.write("CRUISE_SPEED", 2.5, pair.now)
    assert "overtaken" in older.error
    assert answer(pair, newer).value == 2.5


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e12, 1e39])
def test_what_is_no_value_is_refused_here(make_pair, value):
    pair = ready(make_pair, "px4")
    question = answer(pair, pair.station.parameters.write("NAV_DLL_ACT", value, pair.now))
    assert "not a number" in question.error or "does not fit" in question.error
    assert not sets(pair)


@pytest.mark.parametrize("read_before", [False, True])
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_an_integer_is_never_sent_a_fraction(make_pair, autopilot, read_before):
    """A real ArduPilot cuts it off, and keeps what is left."""
    pair = ready(make_pair, autopilot)
    name = WHOLE[autopilot]
    if read_before:
        answer(pair, pair.station.parameters.read(name, pair.now))
    before = pair.vehicle.parameters.entry(name).value
    question = answer(pair, pair.station.parameters.write(name, 2.5, pair.now))
    assert question.error == (
        f"q: parameter {name} = 2.5: it is an integer, and takes no fraction; it stays {before:g}"
    )
    assert not sets(pair)
    assert pair.vehicle.parameters.entry(name).value == before


@pytest.mark.parametrize(
    ("value", "why"),
    [(300, "of a type that this does not fit"), (2.5, "takes no fraction"), (-129, "does not fit")],
)
def test_what_an_integer_cannot_hold_is_not_sent(make_pair, value, why):
    pair = ready(make_pair, "ardupilot")
    question = pair.station.parameters.write("X", value, pair.now)
    pair.run(0.1)
    pair.hear(mav.MAVLink_param_value_message(b"X", 7.0, mav.MAV_PARAM_TYPE_INT8, 1, 0))
    pair.run(0.2)
    assert why in question.error
    assert question.error.endswith("it stays 7")
    assert not sets(pair)


def test_an_integer_of_more_digits_than_a_float_tells_is_not_sent(make_pair):
    pair = ready(make_pair, "ardupilot")
    question = pair.station.parameters.write("X", 2**24 + 1, pair.now)
    pair.run(0.1)
    pair.hear(mav.MAVLink_param_value_message(b"X", 2.0**24, mav.MAV_PARAM_TYPE_INT32, 1, 0))
    pair.run(0.2)
    assert "told as 16777216: it has too many digits" in question.error
    assert not sets(pair)


def test_one_that_takes_another_value_than_it_was_told_is_not_said_to_have_kept_its_own(make_pair):
    pair = ready(make_pair, "ardupilot")
    question = pair.station.parameters.write("X", 9.0, pair.now)
    for value in (4.0, 6.0, 6.0):
        pair.run(RETRY_S + 0.1)
        pair.hear(mav.MAVLink_param_value_message(b"X", value, mav.MAV_PARAM_TYPE_REAL32, 1, 0))
    assert question.error == "q: parameter X = 9: it took 6 instead, and had 4 before"


@pytest.mark.parametrize("value", [-1, 3, 7])
def test_integers_keep_their_bits_on_the_way(make_pair, value):
    pair = ready(make_pair, "px4")
    pair.station.parameters.read("NAV_DLL_ACT", pair.now)
    pair.run(0.2)
    pair.station.parameters.write("NAV_DLL_ACT", value, pair.now)
    pair.run(0.1)
    (m,) = sets(pair)
    assert m.param_type == mav.MAV_PARAM_TYPE_INT32
    assert struct.unpack("<i", struct.pack("<f", m.param_value)) == (value,)


def test_what_nobody_has_asked_for_takes_no_room(make_pair):
    pair = ready(make_pair, "px4")
    for i in range(100):
        pair.hear(mav.MAVLink_param_value_message(f"X{i}".encode(), 1.0, 9, 100, i))
    asked = pair.station.parameters.write("MIS_TAKEOFF_ALT", 3.0, pair.now)
    assert answer(pair, asked).accepted
    assert not pair.station.parameters._asked
