"""Every request is answered once, to the one who asked; nothing that is sent can hurt.

The results are those of ArduPilot 4.6 and PX4 (mavlink.md B2.2, B2.3).
"""

import random
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.transport.mavlink import Codec, mav
from mavherd.vehicles.protocol.commands import LINK_COMMANDS
from mavherd.vehicles.protocol.flight_commands import FLIGHT_COMMANDS

ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED = 0, 1, 2, 3, 4
KNOWN_COMMANDS = set(FLIGHT_COMMANDS) | set(LINK_COMMANDS)
LEGACY = {c for c, row in LINK_COMMANDS.items() if row.is_legacy}
STACKS = ("ardupilot", "px4", "generic")
KINDS = ("quadcopter", "rover")
EVERY_VEHICLE = [*product(STACKS, KINDS)]
RELATIVE = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT
NAN, INF = float("nan"), float("inf")
ABSURD = (NAN, INF, -INF, 3e38, -3e38, 1e-38, -1.0, 0.5)


def long(command, params, system=1, component=1):
    p = (*params, *(0,) * (7 - len(params)))
    return mav.MAVLink_command_long_message(system, component, command, 0, *p)


def as_int(command, params, system=1, component=1):
    p = (*params, *(0,) * (7 - len(params)))
    x, y = (int(max(-(2**31), min(2**31 - 1, v))) if abs(v) < INF else 0 for v in p[4:6])
    return mav.MAVLink_command_int_message(
        system, component, RELATIVE, command, 0, 0, *p[:4], x, y, p[6]
    )


def acks(messages):
    return [m for m in messages if m.get_type() == "COMMAND_ACK"]


# Answers


def knows(stack, kind):
    """Return the commands that this vehicle does not refuse as unknown."""
    elsewhere = {c for c, row in FLIGHT_COMMANDS.items() if kind not in row.kinds}
    return KNOWN_COMMANDS - elsewhere - (LEGACY if stack == "px4" else set())


@pytest.mark.parametrize("form", [long, as_int])
@pytest.mark.parametrize(("stack", "kind"), EVERY_VEHICLE)
def test_every_command_id_has_exactly_one_answer(desk, stack, kind, form):
    vehicle = desk(kind, autopilot=stack)
    some = {*range(600), *range(600, 65536, 61), *range(31000, 31020), 42424, 65535}
    for command in sorted(some | KNOWN_COMMANDS):
        replies = vehicle.send(form(command, (1,)))
        (ack,) = acks(replies)
        assert ack.command == command
        assert (ack.target_system, ack.target_component) == vehicle.GROUND
        known = command in knows(stack, kind)
        assert (ack.result != UNSUPPORTED) is known, command
        assert known or len(replies) == 1


def test_the_commands_of_the_specification_are_all_there():
    needed = {400, 22, 21, 20, 300, 176, 192, 178, 115, 179, 224, 511, 510, 512, 520, 410, 246, 401}
    assert needed <= KNOWN_COMMANDS
    assert needed <= knows("ardupilot", "quadcopter")
    assert needed - knows("ardupilot", "rover") == {22, 21, 115}
    assert not set(FLIGHT_COMMANDS) & set(LINK_COMMANDS)


def in_the_air(desk, stack, kind):
    """Return a vehicle under way."""
    vehicle = desk(kind, autopilot=stack)
    if stack == "px4" and kind == "quadcopter":
        vehicle.arm()
        vehicle.command(22, 0, 0, 0, NAN, NAN, NAN, NAN)
        vehicle.run(4)
        assert vehicle.autopilot.in_air
    elif stack == "px4":
        vehicle.stream(vehicle.target(0xDF8, x=5), 0.5)
        vehicle.mode("OFFBOARD")
        vehicle.arm()
    else:
        vehicle.fly()
    return vehicle


@pytest.mark.parametrize("form", [long, as_int])
@pytest.mark.parametrize(("stack", "kind"), EVERY_VEHICLE)
@pytest.mark.parametrize("command", sorted(KNOWN_COMMANDS))
def test_absurd_parameters_are_answered_too(desk, stack, kind, command, form):
    vehicle = in_the_air(desk, stack, kind)
    for base in (0.0, 1.0, 30.0):
        for at in range(7):
            for value in ABSURD:
                params = [base] * 7
                params[at] = value
                assert len(acks(vehicle.send(form(command, params)))) == 1
            vehicle.run(0.01)
    for value in ABSURD:
        assert len(acks(vehicle.send(form(command, [value] * 7)))) == 1
    vehicle.run(0.5)
    assert all(abs(v) < 1e3 for v in vehicle.where)


def test_the_ack_comes_first_and_goes_to_whoever_asked(quad):
    for system, component in ((255, 0), (245, 190), (254, 190), (1, 190)[::-1]):
        asker = Codec(system, component)
        reply = quad.vehicle.handle(asker.encode([long(512, (0,))]), quad.link)
        ack, heartbeat = asker.decode(reply)
        assert (ack.target_system, ack.target_component) == (system, component)
        assert heartbeat.get_type() == "HEARTBEAT"
        assert (ack.get_srcSystem(), ack.get_srcComponent()) == (1, 1)


@pytest.mark.parametrize(("system", "component"), [(0, 0), (0, 1), (1, 0), (1, 1)])
def test_broadcasts_and_own_ids_are_heard(quad, system, component):
    (ack,) = quad.send(long(400, (1,), system, component))
    assert ack.result == ACCEPTED
    assert quad.autopilot.armed


@pytest.mark.parametrize("stack", STACKS)
@pytest.mark.parametrize(("system", "component"), [(2, 1), (255, 1), (2, 99), (2, 0)])
def test_messages_for_others_are_ignored(desk, stack, system, component):
    quad = desk("quadcopter", autopilot=stack)
    mode = quad.autopilot.mode
    assert quad.send(long(400, (1,), system, component)) == []
    assert quad.send(as_int(400, (1,), system, component)) == []
    assert quad.send(mav.MAVLink_set_mode_message(2, 1, 4)) == []
    assert not quad.autopilot.armed
    assert quad.autopilot.mode is mode


@pytest.mark.parametrize("form", [long, as_int])
@pytest.mark.parametrize("stack", STACKS)
@pytest.mark.parametrize("component", [99, 190, 154, 2])
def test_only_ardupilot_answers_for_components_that_it_does_not_have(desk, stack, form, component):
    quad = desk("quadcopter", autopilot=stack)
    answers = quad.send(form(512, (0,), 1, component), form(31999, (), 1, component))
    results = [m.result for m in acks(answers)]
    assert results == ([ACCEPTED, UNSUPPORTED] if stack == "ardupilot" else [])


def test_targets_for_others_are_ignored(quad):
    quad.fly()
    message = quad.target(0xDF8, x=50, z=-3)
    message.target_system = 2
    quad.send(message)
    quad.run(3)
    assert abs(quad.where.north) < 0.2


def test_an_echo_of_our_own_is_ignored(quad):
    mirror = Codec(1, 1)
    assert quad.vehicle.handle(mirror.encode([long(400, (1,))]), quad.link) == b""
    assert not quad.autopilot.armed


def test_commands_are_the_same_in_both_forms(desk):
    a, b = desk(), desk()
    for command, params in (
        (176, (1, 4)),
        (400, (1,)),
        (22, (0, 0, 0, 0, 0, 0, 3)),
        (511, (30, 5e4)),
        (510, (30,)),
        (512, (148,)),
        (410, ()),
        (520, ()),
        (401, ()),
        (178, (1, 2)),
        (115, (90, 20, 1, 0)),
        (207, (1,)),
        (179, (1,)),
        (224, (3,)),
        (300, ()),
        (246, (1,)),
        (21, ()),
        (20, ()),
    ):
        long_reply, int_reply = a.send(long(command, params)), b.send(as_int(command, params))
        assert list(map(str, long_reply)) == list(map(str, int_reply))
    assert list(map(str, a.run(2))) == list(map(str, b.run(2)))


# Messages on request


def test_every_message_we_make_can_be_requested_and_no_other(quad):
    quad.fly()
    quad.send(quad.target(0xDF8, z=-3))
    telemetry = quad.vehicle.telemetry
    offered = {i for i in telemetry.ids if telemetry.make(i) is not None}
    for message_id in [*range(500), *range(500, 70000, 997), -1, 1 << 24]:
        ack, *rest = quad.send(long(512, (message_id,)))
        if message_id in offered:
            assert ack.result == ACCEPTED
            readable = [message_id] if message_id in mav.mavlink_map else []
            assert [m.get_msgId() for m in rest] == readable
        else:
            assert (ack.result, rest) == (FAILED, [])


def test_a_target_that_is_not_there_cannot_be_requested(quad):
    (ack,) = quad.send(long(512, (mav.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED,)))
    assert ack.result == FAILED


def test_the_legacy_requests_work(quad):
    (ack, version) = quad.send(long(520, (1,), 0, 0))
    assert (ack.result, version.get_type()) == (ACCEPTED, "AUTOPILOT_VERSION")
    (ack, home) = quad.send(long(410, ()))
    assert (ack.result, home.get_type()) == (ACCEPTED, "HOME_POSITION")


# What ArduCopter 4.6 and PX4 answer

VERSION, PROTOCOL, HOME, ORIGIN = 148, 300, 242, 49
STATE, ATTITUDE_ID, MODES, MODE, METADATA, INFORMATION = 245, 30, 435, 436, 397, 395
CAMERA, GIMBAL, UNKNOWN = 259, 280, 60000


@pytest.mark.parametrize("form", [long, as_int])
@pytest.mark.parametrize(
    ("command", "params", "ardupilot", "px4"),
    [
        (512, (VERSION,), ACCEPTED, ACCEPTED),
        (512, (PROTOCOL,), FAILED, ACCEPTED),
        (519, (1,), UNSUPPORTED, UNSUPPORTED),
        (520, (1,), ACCEPTED, UNSUPPORTED),
        (512, (MODES,), FAILED, ACCEPTED),
        (512, (MODE,), FAILED, ACCEPTED),
        (512, (HOME,), ACCEPTED, ACCEPTED),
        (512, (ORIGIN,), ACCEPTED, ACCEPTED),
        (410, (), ACCEPTED, UNSUPPORTED),
        (512, (GIMBAL,), FAILED, DENIED),
        (512, (CAMERA,), FAILED, DENIED),
        (521, (1,), UNSUPPORTED, UNSUPPORTED),
        (512, (STATE,), ACCEPTED, ACCEPTED),
        (512, (ATTITUDE_ID,), ACCEPTED, ACCEPTED),
        (512, (UNKNOWN,), FAILED, DENIED),
        (511, (ATTITUDE_ID, 1e5), ACCEPTED, ACCEPTED),
        (511, (UNKNOWN, 1e5), DENIED, FAILED),
        (510, (ATTITUDE_ID,), ACCEPTED, ACCEPTED),
        (31999, (), UNSUPPORTED, UNSUPPORTED),
        (401, (), ACCEPTED, ACCEPTED),
        (400, (0,), ACCEPTED, ACCEPTED),
        (22, (0, 0, 0, 0, 0, 0, 5), FAILED, ACCEPTED),  # disarmed
    ],
)
def test_the_results_are_those_of_the_real_ones(desk, command, params, ardupilot, px4, form):
    for stack, result in (("ardupilot", ardupilot), ("px4", px4)):
        quad = desk("quadcopter", autopilot=stack)
        (ack,) = acks(quad.send(form(command, params)))
        assert ack.result == result, stack


def test_component_metadata_is_offered_so_that_groundcontrol_starts_faster(quad):
    for message_id in (METADATA, INFORMATION):
        assert quad.command(512, message_id) in (ACCEPTED, FAILED)


def test_a_refused_interval_says_why_on_ardupilot(desk, texts):
    for stack, said in (("ardupilot", ["No ap_message for mavlink id (60000)"]), ("px4", [])):
        quad = desk("quadcopter", autopilot=stack)
        quad.command(511, UNKNOWN, 1e5)
        assert texts(quad.run(0.1)) == said


def test_a_flood_of_refused_intervals_is_told_once_a_second(quad, texts):
    said = []
    for i in range(200):
        quad.command(511, 50_000 + i, 1e5)
        said += texts(quad.run(0.01))
    assert 2 <= len(said) <= 3


def test_running_the_checks_names_what_hinders(desk, texts):
    fence = {"FENCE_ENABLE": 1, "FENCE_RADIUS": 1, "FENCE_MARGIN": 2}
    quad = desk("quadcopter", params=fence)
    assert quad.command(401) == ACCEPTED
    assert "PreArm: Circle FENCE_MARGIN is less than FENCE_RADIUS" in "".join(texts(quad.run(0.1)))
    assert quad.command(400, 1) == FAILED
    assert quad.command(400, 1, 21196) == ACCEPTED
    assert quad.command(401) == REJECTED, "it is armed"


@pytest.mark.parametrize("number", [21196, 2989])
def test_both_magic_numbers_arm_without_checks_and_one_disarms_in_the_air(desk, number):
    quad = desk("quadcopter")
    quad.command(176, 1, 6)
    assert quad.command(400, 1) == FAILED, "RTL is not armable"
    assert quad.command(400, 1, number) == ACCEPTED
    quad.command(176, 1, 4)
    assert quad.command(22, 0, 0, 0, 0, 0, 0, 3) == ACCEPTED
    quad.run(5)
    assert quad.command(400, 0, 2989) == FAILED
    assert quad.command(400, 0, 21196) == ACCEPTED


def test_the_vtol_forms_of_takeoff_and_landing_work(desk):
    quad = desk("quadcopter")
    quad.command(176, 1, 4)
    quad.command(400, 1)
    assert quad.command(84, 0, 0, 0, 0, 0, 0, 3) == ACCEPTED
    quad.run(6)
    assert quad.where.down == pytest.approx(-3, abs=0.3)
    assert quad.command(85) == ACCEPTED
    assert quad.autopilot.mode.name == "LAND"


def test_guided_flight_is_paused_and_goes_on(desk, texts):
    quad = desk("quadcopter", profile="ardupilot")
    quad.command(176, 1, 4)
    quad.command(400, 1)
    assert quad.command(193, 0) == FAILED, "on the ground"
    assert "Failed to pause" in texts(quad.run(0.1))
    quad.command(22, 0, 0, 0, 0, 0, 0, 5)
    quad.run(5)
    assert quad.command(193, 0) == FAILED, "taking off"
    quad.run(5)
    quad.send(quad.target(0xDF8, x=60, z=-5))
    quad.run(3)
    assert quad.command(193, 0) == ACCEPTED
    quad.run(5)
    stopped = quad.where
    assert abs(stopped.v_north) < 0.05
    assert 1 < stopped.north < 40
    assert quad.command(193, 1) == ACCEPTED
    quad.run(12)
    assert quad.where.north == pytest.approx(60, abs=0.5)
    assert quad.command(193, 2) == DENIED
    quad.command(176, 1, 17)
    assert quad.command(193, 0) == FAILED, "BRAKE has nothing to pause"


@pytest.mark.parametrize("stack", STACKS)
@pytest.mark.parametrize(
    ("command", "params"), [(300, ()), (300, (1, 2)), (224, (5,)), (224, (NAN,)), (300, (NAN,))]
)
def test_a_mission_that_is_not_there_is_not_started(desk, stack, command, params):
    quad = desk("quadcopter", autopilot=stack)
    assert quad.command(command, *params) in (DENIED, FAILED)


def test_a_fence_is_switched_by_command(desk):
    quad = desk("quadcopter", params={"FENCE_TYPE": 2, "FENCE_RADIUS": 50})
    assert quad.command(207, 1) == ACCEPTED
    assert quad.autopilot.fence.enabled
    assert quad.command(207, 0) == ACCEPTED
    assert not quad.autopilot.fence.enabled
    for value in (3, -1, 0.5e9, NAN, INF):
        assert quad.command(207, value) == DENIED


# Streams, per link


def counts(desk, seconds, *links):
    """Let time pass; return how many of each message each link got."""
    totals = [{} for _ in links]
    codecs = [Codec(255) for _ in links]
    for _ in range(round(seconds * 100)):
        desk.vehicle.step()
        broadcasts = desk.vehicle.take_broadcasts()
        for link, codec, total in zip(links, codecs, totals, strict=True):
            for m in codec.decode(desk.vehicle.report(link, broadcasts)):
                total[m.get_type()] = total.get(m.get_type(), 0) + 1
    return totals


@pytest.mark.parametrize("rate", [1, 5, 20, 30, 50, 100])
def test_an_asked_rate_is_kept_within_5_percent_on_that_link_only(quad, rate):
    other = quad.vehicle.converse(spoken=True)
    assert quad.command(511, mav.MAVLINK_MSG_ID_ATTITUDE, 1e6 / rate) == ACCEPTED
    mine, theirs = counts(quad, 20, quad.link, other)
    assert mine["ATTITUDE"] == pytest.approx(20 * rate, rel=0.05)
    assert theirs["ATTITUDE"] == pytest.approx(200, rel=0.05)


def test_minus_one_stops_and_zero_restores_the_default(quad):
    attitude = mav.MAVLINK_MSG_ID_ATTITUDE
    quad.command(511, attitude, -1)
    assert "ATTITUDE" not in counts(quad, 3, quad.link)[0]
    quad.command(511, attitude, 0)
    assert counts(quad, 10, quad.link)[0]["ATTITUDE"] == pytest.approx(100, rel=0.05)


def test_even_heartbeats_obey(quad):
    quad.command(511, 0, 2e5)
    assert counts(quad, 10, quad.link)[0]["HEARTBEAT"] == pytest.approx(50, abs=2)


@pytest.mark.parametrize("interval", [NAN, INF, -INF])
def test_an_interval_that_is_no_number_is_denied(quad, interval):
    assert quad.command(511, 30, interval) == DENIED
    assert quad.command(511, interval, 1e5) == DENIED


def test_streams_that_are_not_offered_are_refused(quad):
    for message_id in (60000, 76, -5, 3e38):
        assert quad.command(511, message_id, 1e5) == DENIED  # ArduPilot's answer
    for message_id in (-5, 3e38):
        assert quad.command(510, message_id) == FAILED


@pytest.mark.parametrize(
    ("asked", "told"), [(5e4, 50_000), (-1, -1), (0, 100_000), (3e38, 2**31 - 1), (1, 10_000)]
)
def test_the_interval_can_be_asked_for(quad, asked, told):
    quad.command(511, 30, asked)
    ack, interval = quad.ask(510, 30)
    assert ack.result == ACCEPTED
    assert (interval.message_id, interval.interval_us) == (30, told)


def test_an_unspoken_link_gets_heartbeats_only_and_everything_once_it_speaks(quad):
    shy = quad.vehicle.converse()
    (before,) = counts(quad, 5, shy)
    assert set(before) == {"HEARTBEAT"}
    assert before["HEARTBEAT"] in (5, 6)  # one extra at boot
    quad.vehicle.handle(b"\xfd garbage is not speech \xfe", shy)
    assert set(counts(quad, 2, shy)[0]) == {"HEARTBEAT"}
    hello = Codec(255).encode([mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)])
    quad.vehicle.handle(hello, shy)
    (after,) = counts(quad, 5, shy)
    assert {"ATTITUDE", "LOCAL_POSITION_NED", "HOME_POSITION", "SYS_STATUS"} <= set(after)


# Whatever the dialect has


def fields_of(message_class):
    lengths = [message_class.array_lengths[at] for at in message_class.orders]
    return zip(message_class.fieldtypes, lengths, strict=True)


def value(rng: random.Random, kind: str, length: int):
    if kind == "char":
        return bytes(rng.randrange(256) for _ in range(length or 1))
    if length:
        return [value(rng, kind, 0) for _ in range(length)]
    if kind in ("float", "double"):
        return rng.choice([0.0, 1.0, -1.0, NAN, INF, -INF, 3e38, rng.uniform(-100, 100)])
    bits = int("".join(c for c in kind.removesuffix("_t") if c.isdigit()))
    low, high = (
        (0, 2**bits - 1) if kind.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    )
    return rng.choice([low, high, 0, 1, rng.randint(low, high)])


def any_message(rng: random.Random, message_class):
    values = [value(rng, kind, length) for kind, length in fields_of(message_class)]
    message = message_class(*values)
    for name, own in (("target_system", (0, 1)), ("target_component", (0, 1))):
        if name in message_class.fieldnames and rng.random() < 0.8:
            setattr(message, name, rng.choice(own))
    return message


@pytest.mark.parametrize(("stack", "kind"), EVERY_VEHICLE)
def test_a_flood_of_every_message_of_the_dialect_never_hurts(desk, stack, kind):
    vehicle, rng = in_the_air(desk, stack, kind), random.Random(5)
    classes = [c for c in mav.mavlink_map.values() if c.id >= 0]
    assert len(classes) > 200
    for _ in range(8):
        for message_class in rng.sample(classes, len(classes)):
            message = any_message(rng, message_class)
            vehicle.send(message)
            if rng.random() < 0.05:
                vehicle.run(0.02)
    vehicle.run(1)
    assert all(abs(v) < 1e3 for v in vehicle.where)
    assert vehicle.command(31999) == UNSUPPORTED


ANY_COMMAND = st.tuples(
    st.sampled_from(sorted(KNOWN_COMMANDS)),
    st.lists(st.floats(width=32), min_size=7, max_size=7),
)


@given(st.lists(ANY_COMMAND, max_size=12))
def test_any_sequence_of_commands_has_as_many_answers(desk, commands):
    vehicle = desk()
    replies = vehicle.send(*(long(command, params) for command, params in commands))
    assert [m.command for m in acks(replies)] == [command for command, _ in commands]
    vehicle.run(0.05)


@given(st.binary(max_size=400))
def test_random_bytes_are_no_message(desk, data):
    vehicle = desk("rover")
    vehicle.vehicle.handle(data, vehicle.link)
    vehicle.run(0.02)
    assert not vehicle.autopilot.armed


def test_a_companion_computer_with_the_vehicles_own_system_id_is_answered(desk):
    vehicle = desk("quadcopter")
    companion = Codec(1, 191)
    reply = vehicle.vehicle.handle(companion.encode([long(31999, ())]), vehicle.link)
    (ack,) = Codec(9).decode(reply)
    assert (ack.result, ack.target_system, ack.target_component) == (UNSUPPORTED, 1, 191)
    echo = Codec(1, 1)
    assert vehicle.vehicle.handle(echo.encode([long(31999, ())]), vehicle.link) == b""


def test_a_takeoff_that_would_not_leave_the_ground_is_refused_with_a_reason(desk):
    vehicle = desk("quadcopter")
    vehicle.send(long(176, (1, 4)), long(400, (1,)))
    (ack,) = acks(vehicle.send(long(22, (0, 0, 0, 0, 0, 0, 0.1))))
    assert ack.result == FAILED
    texts = [m.text for m in vehicle.run(0.1) if m.get_type() == "STATUSTEXT"]
    assert any("out of range" in text for text in texts)


def test_a_thousand_mode_changes_at_once_are_one_heartbeat_and_few_texts(desk):
    vehicle = desk("quadcopter")
    vehicle.run(0.1)
    changes = [mav.MAVLink_set_mode_message(1, 1, 4 if k % 2 else 5) for k in range(1000)]
    nonsense = [mav.MAVLink_set_mode_message(1, 1, 1000 + k) for k in range(1000)]
    vehicle.send(*changes, *nonsense)
    names = [m.get_type() for m in vehicle.run(0.01)]
    assert names.count("HEARTBEAT") <= 2
    assert 1 <= names.count("STATUSTEXT") <= 40


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4", "generic"])
def test_a_takeoff_in_a_local_frame_is_denied(desk, autopilot):
    quad = desk("quadcopter", autopilot=autopilot)
    takeoff = mav.MAVLink_command_int_message(1, 1, 1, 22, 0, 0, 0, 0, 0, 0, 0, 0, 500)
    (ack,) = quad.send(takeoff)
    assert ack.result == mav.MAV_RESULT_DENIED
