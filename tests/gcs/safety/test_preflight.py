"""Preflight says of each vehicle what is missing, why, and what to do about it."""

from dataclasses import replace
from math import inf, nan, radians
from shlex import split

import pytest

from mavherd.gcs.safety.preflight import ask_fence, checklist, missing
from mavherd.gcs.station import ARDUPILOT, PX4, Question, Station
from mavherd.scenarios.schema import Fence, Goto, Point, RobotSpec, Scenario
from mavherd.transport.frames import Origin
from mavherd.transport.mavlink import AUTOPILOT_COMPONENT, Codec, mav
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.vehicle import Vehicle

NAMES = ["link", "identity", "position", "origin", "place", "battery", "fence", "ready"]
ORIGIN = Origin(-35.36, 149.16, 584.0)
SPEC = RobotSpec(
    name="quad1",
    kind="quadcopter",
    system_id=1,
    start=Point(3.0, -2.0),
    heading=radians(90),
    path=Goto(target=Point(3.0, 10.0, 5.0)),
    autopilot="auto",
    connect="tcp:127.0.0.1:5760",
)
SCENARIO = Scenario(name="field", robots=(SPEC,), origin=ORIGIN)
NOW = 50.0


def station(kind="quadcopter", stack=ARDUPILOT, origin=ORIGIN) -> Station:
    """Return the station of a vehicle that lacks nothing, as of `NOW`; `origin` is its own."""
    station = Station("quad1", 1, 5.0, kind=kind, stack=stack, origin=ORIGIN)
    mav_type = {"quadcopter": mav.MAV_TYPE_QUADROTOR, "rover": mav.MAV_TYPE_GROUND_ROVER}[kind]
    autopilot = stack.personality.autopilot
    place = [round(deg * 1e7) for deg in ORIGIN.to_geodetic(-2.0, 3.0)]
    north, east = origin.from_geodetic(*ORIGIN.to_geodetic(-2.0, 3.0))
    own = [round(deg * 1e7) for deg in (origin.lat_deg, origin.lon_deg)]
    ready = mav.MAV_SYS_STATUS_PREARM_CHECK
    messages = [
        mav.MAVLink_heartbeat_message(mav_type, autopilot, 0, 0, 3, 3),
        mav.MAVLink_gps_global_origin_message(*own, 584_000, 0),
        mav.MAVLink_local_position_ned_message(0, north, east, 0, 0, 0, 0),
        mav.MAVLink_global_position_int_message(0, *place, 584_000, 0, 0, 0, 0, 0),
        mav.MAVLink_local_position_ned_message(0, north, east, 0, 0, 0, 0),
        mav.MAVLink_gps_raw_int_message(0, 3, *place, 584_000, 1, 1, 0, 0, 10),
        mav.MAVLink_sys_status_message(*[ready] * 3, 0, 16_200, 0, 80, 0, 0, 0, 0, 0, 0),
        mav.MAVLink_extended_sys_state_message(0, mav.MAV_LANDED_STATE_ON_GROUND),
    ]
    station.receive(Codec(1, AUTOPILOT_COMPONENT).encode(messages), NOW - 0.2)
    return station


def check(name, spec=SPEC, now=NOW, fence=None, of=None, **status):
    """Return one check of such a vehicle, of which something is different."""
    of = of or station(spec.kind)
    for key, value in status.items():
        setattr(of.status, key, value)
    checks = checklist(of, spec, SCENARIO, now, fence)
    assert [each.name for each in checks] == NAMES
    return next(each for each in checks if each.name == name)


def test_a_vehicle_that_lacks_nothing_may_arm_and_the_checks_have_their_order():
    checks = checklist(station(), SPEC, SCENARIO, NOW)
    assert [each.name for each in checks] == NAMES
    assert missing(checks) == []
    assert all(each.ok for each in checks if each.name != "fence")


def test_before_anything_is_heard_only_the_link_is_wrong():
    fresh = Station("quad1", 1, 5.0, stack=None, origin=ORIGIN)
    checks = checklist(fresh, SPEC, SCENARIO, 0.5)
    (wrong,) = missing(checks)
    assert (wrong.name, wrong.ok) == ("link", False)
    assert "tcp:127.0.0.1:5760" in wrong.text
    assert {each.ok for each in checks[1:]} == {None}


def test_nobody_stands_at_minus_zero():
    found = check("place", position=(-0.02, -9.0, 0.0))  # north, east, down
    assert "stands at east -9.0, north 0.0, " in found.text
    assert "start: {east: -9.0, north: 0.0}" in found.cure


def test_a_link_is_lost_after_three_seconds():
    assert check("link", heartbeat_at=NOW - 2.9).ok
    lost = check("link", heartbeat_at=NOW - 7.2)
    assert (lost.ok, lost.text) == (False, "silent for 7 s on tcp:127.0.0.1:5760")


def test_another_kind_or_flight_stack_is_another_vehicle():
    found = check("identity", of=station("rover"))
    assert found.ok is False
    assert "it is a ground rover, not a quadcopter" in found.text
    other = check("identity", replace(SPEC, autopilot="px4"))
    assert other.ok is False
    assert "ardupilot, not px4" in other.text
    assert check("identity", replace(SPEC, autopilot="ardupilot")).ok


@pytest.mark.parametrize(
    ("status", "text"),
    [
        ({"gps_fix": 1}, "no fix, 10 satellites"),
        ({"gps_fix": 0, "satellites": None}, "no GPS"),
        (
            {"position_at": -1.0, "global_position": None},
            "no position yet; 3D fix, 10 satellites",
        ),
        (
            {"position_at": NOW - 9, "global_position_at": NOW - 9, "gps_fix": None},
            "no position for 9 s",
        ),
    ],
)
def test_without_a_fresh_position_nobody_starts(status, text):
    found = check("position", **status)
    assert found.ok is False
    assert found.text == text
    assert found.cure


def test_a_vehicle_that_answers_nothing_may_not_want_to_hear_us():
    deaf = Station("quad1", 1, 5.0, stack=ARDUPILOT, origin=ORIGIN)
    deaf.status.heartbeat_at = NOW
    found = check("position", of=deaf)
    assert found.text == "it tells nothing but heartbeats"
    assert "SYSID_ENFORCE" in found.cure


def test_a_vehicle_that_does_not_tell_of_gps_may_know_its_place_otherwise():
    assert check("position", gps_fix=None).ok


def test_the_origin_is_waited_for_and_then_for_its_proof():
    fresh = Station("quad1", 1, 5.0, stack=ARDUPILOT, origin=ORIGIN)
    fresh.status.heartbeat_at = NOW
    waits = check("origin", of=fresh)
    assert (waits.ok, waits.text) == (None, fresh.waits_for)
    moved = Origin(*ORIGIN.to_geodetic(30.0, 40.0), ORIGIN.alt_m)
    found = check("origin", of=station(origin=moved))
    assert found.ok
    assert "50.0 m from the fleet's" in found.text
    assert check("place", of=station(origin=moved)).text == "0.0 m from its start"


def test_an_origin_far_away_is_no_matter_of_patience_nor_of_identity():
    far = station(origin=Origin(47.4, 8.5, 584.0))
    found = check("origin", of=far)
    assert found.ok is False
    assert "km from the fleet's" in found.text
    assert check("identity", of=far).ok


def test_a_vehicle_that_stands_elsewhere_is_told_where_and_how_to_get_there():
    assert check("place", position=(-2.0, 4.9, 0.0)).ok
    found = check("place", position=(-2.0, 8.0, 0.0))
    assert found.ok is False
    assert found.text == "stands at east 8.0, north -2.0, 5.0 m from its start"
    assert "move it to east 3, north -2" in found.cure
    assert "`start: {east: 8.0, north: -2.0}`" in found.cure


@pytest.mark.parametrize(("heading_deg", "compass"), [(90, 0), (0, 90), (180, 270), (45, 45)])
def test_the_cure_for_a_simulator_puts_it_where_the_scenario_wants_it(heading_deg, compass):
    spec = replace(SPEC, heading=radians(heading_deg))
    cure = check("place", spec, position=(90.0, 90.0, 0.0)).cure
    (home,) = (word for word in split(cure) if word.startswith("--home="))
    lat, lon, alt, heading = map(float, home.removeprefix("--home=").split(","))
    north, east = ORIGIN.from_geodetic(lat, lon)
    assert (round(north, 2), round(east, 2), alt) == (-2.0, 3.0, 584.0)
    assert heading == compass


def test_a_px4_simulator_has_other_words_for_home():
    cure = check("place", of=station(stack=PX4), position=(90.0, 90.0, 0.0)).cure
    assert "PX4_HOME_LAT=-35.36" in cure
    assert "--home" not in cure


def test_a_low_battery_is_missing_and_an_unknown_one_is_only_told():
    low = check("battery", battery_remaining=0.29)
    assert (low.ok, low.text) == (False, "29% left, 16.2 V")
    assert "30% or more" in low.cure
    assert check("battery", battery_remaining=0.3).ok
    unknown = check("battery", battery_remaining=None)
    assert (unknown.ok, unknown.required) == (None, False)
    silent = station()
    silent.status.battery_remaining = None
    assert missing(checklist(silent, SPEC, SCENARIO, NOW)) == []


def answered(**values):
    return {
        name: Question(name, station().status.texts, 0.0, value=value, accepted=True)
        for name, value in values.items()
    }


@pytest.mark.parametrize(
    ("told", "ok", "text"),
    [
        ({"FENCE_ENABLE": 0, "FENCE_TYPE": 7, "FENCE_RADIUS": 300}, False, "off"),
        ({"FENCE_ENABLE": 1, "FENCE_TYPE": 7, "FENCE_RADIUS": 30}, True, "30 m around home"),
        ({"FENCE_ENABLE": 1, "FENCE_TYPE": 7, "FENCE_RADIUS": 12}, False, "path leads 12 m away"),
        ({"FENCE_ENABLE": 1, "FENCE_TYPE": 4, "FENCE_RADIUS": 12}, True, "without a circle"),
        ({"GF_MAX_HOR_DIST": 0}, False, "off"),
        ({"GF_MAX_HOR_DIST": 30}, True, "30 m around home"),
    ],
)
def test_the_vehicle_s_own_fence_is_told_but_not_required(told, ok, text):
    found = check("fence", fence=answered(**told))
    assert (found.ok, found.required) == (ok, False)
    assert text in found.text


def test_a_fence_that_is_not_told_in_full_is_unknown():
    told = answered(FENCE_ENABLE=1, FENCE_TYPE=7)
    told["FENCE_RADIUS"] = Question("FENCE_RADIUS", station().status.texts, 0.0)
    assert check("fence", fence=told).ok is None
    told["FENCE_RADIUS"].problem = "it has no such parameter"
    assert check("fence", fence=told).ok is None


@pytest.mark.parametrize("value", [nan, inf])
def test_a_fence_of_nonsense_is_no_fence_and_no_crash(value):
    full = {"FENCE_ENABLE": 1, "FENCE_TYPE": 7, "FENCE_RADIUS": 30}
    assert check("fence", fence=answered(**(full | {"FENCE_RADIUS": value}))).ok is None
    assert check("fence", fence=answered(**(full | {"FENCE_TYPE": value}))).name == "fence"


def test_the_reason_for_not_arming_is_what_the_vehicle_said_last():
    s = station()
    s.status.prearm_ok = False
    s.status.texts.extend(
        [
            (5.0, 2, "PreArm: Gyros inconsistent"),
            (35.0, 2, "PreArm: Battery 1 low"),
            (35.1, 2, "PreArm: Need Position Estimate"),
            (36.0, 6, "EKF3 IMU0 origin set"),
        ]
    )
    found = check("ready", of=s)
    assert found.ok is False
    assert found.text == "says 'PreArm: Battery 1 low', 'PreArm: Need Position Estimate'"


def test_readiness_is_waited_for_until_it_is_told_and_not_asked_of_those_who_never_tell():
    assert check("ready", sensors=None, prearm_ok=None).ok is None
    assert check("ready", prearm_ok=False).text == "may not arm yet"
    mute = check("ready", prearm_ok=None)
    assert (mute.ok, mute.required) == (None, False)


def test_nobody_takes_over_a_vehicle_in_flight():
    assert check("ready", armed=True, landed=False).ok is False
    assert check("ready", armed=True, landed=None).ok is False
    assert check("ready", armed=True, landed=True, prearm_ok=False).ok
    rover = replace(SPEC, kind="rover", path=Goto(target=Point(3.0, 10.0)))
    assert check("ready", rover, armed=True, landed=None).ok


def test_nobody_takes_over_a_rover_that_somebody_drives():
    rover = replace(SPEC, kind="rover", path=Goto(target=Point(3.0, 10.0)))
    assert check("ready", rover, armed=True, velocity=(0.1, 0.1, 0.0)).ok
    driven = check("ready", rover, armed=True, velocity=(0.0, -0.5, 0.0))
    assert (driven.ok, driven.text) == (False, "armed already, and moving")


def test_nobody_starts_from_outside_the_fence_though_near_its_start():
    for west, ok in ((2.0, False), (1.0, True)):
        fenced = replace(SCENARIO, fence=Fence(east=(west, 9.0), north=(-9.0, 20.0), up=10.0))
        s = station()
        s.status.position = (-2.0, 1.5, -0.1)  # its start is at east 3
        place = next(c for c in checklist(s, SPEC, fenced, NOW) if c.name == "place")
        assert place.ok is ok, place
        assert ("outside the fence" in place.text) is not ok


def test_what_is_wrong_stands_before_what_is_not_known():
    s = station()
    s.status.sensors = s.status.prearm_ok = None
    assert [c.name for c in missing(checklist(s, SPEC, SCENARIO, NOW))] == ["ready"]
    s.status.battery_remaining = 0.1
    assert [c.name for c in missing(checklist(s, SPEC, SCENARIO, NOW))] == ["battery"]


HARMLESS = {
    "HEARTBEAT",
    "PARAM_REQUEST_READ",
    "MAV_CMD_SET_MESSAGE_INTERVAL",
    "MAV_CMD_REQUEST_MESSAGE",
}


def purpose(message):
    """Return what a message of ours is, commands by name."""
    name = message.get_type()
    return mav.enums["MAV_CMD"][message.command].name if name == "COMMAND_LONG" else name


@pytest.mark.parametrize(
    ("autopilot", "params", "text"),
    [
        ("ardupilot", {"FENCE_ENABLE": 1, "FENCE_RADIUS": 40}, "its own is on, 40 m around home"),
        ("ardupilot", {}, "its own is off"),
        ("px4", {"GF_MAX_HOR_DIST": 40}, "its own is on, 40 m around home"),
        ("px4", {}, "its own is off"),
    ],
)
def test_a_real_one_is_found_ready_tells_of_its_fence_and_is_not_touched(autopilot, params, text):
    config = VehicleConfig(
        kind="quadcopter",
        system_id=1,
        autopilot=autopilot,
        params=params,
        origin=ORIGIN,
        north=-1.0,
        east=3.0,
    )
    vehicle = Vehicle(config)
    link = vehicle.converse()
    station = Station("quad1", 1, 5.0, stack=None, origin=ORIGIN)
    fence, now, sent = {}, 0.0, set()
    for _ in range(200):
        fence = fence or ask_fence(station, now)
        out = station.transmit(now)
        sent.update(map(purpose, Codec(1).decode(out)))
        data = vehicle.handle(out, link)
        for _ in range(5):
            vehicle.step()
            data += vehicle.report(link, vehicle.take_broadcasts())
        now = vehicle.now_us * 1e-6
        station.receive(data, now)
    checks = {c.name: c for c in checklist(station, SPEC, SCENARIO, now, fence)}
    assert sent <= HARMLESS
    assert missing(list(checks.values())) == []
    assert autopilot in checks["identity"].text
    assert checks["place"].text == "1.0 m from its start"
    assert checks["fence"].text == text
