"""The fence tells and meets a breach once, refuses targets beyond it, and lets go afterwards."""

from math import cos, hypot, inf, pi, sin

import pytest

from mavherd.transport.mavlink import mav
from mavherd.vehicles.flight.areas import Areas
from mavherd.vehicles.missions.items import Item, MissionType
from mavherd.vehicles.robot import Vec3

ACCEPTED, DENIED, FAILED = 0, 2, 4
ARM, SET_MODE, FENCE_ENABLE = 400, 176, 207
POSITION, VELOCITY = 0xDF8, 0xDC7
RTL, LAND, BRAKE, GUIDED, STABILIZE = 6, 9, 17, 4, 0
INCLUSION, EXCLUSION, CIRCLE_IN, CIRCLE_OUT = 5001, 5002, 5003, 5004


def put(desk, **values):
    for name, value in values.items():
        desk.autopilot.parameters.set(name, value)


def mode(desk):
    return desk.autopilot.modes.number(desk.autopilot.mode)


def push(desk, seconds, **velocity):
    """Stream a velocity."""
    out = []
    for _ in range(round(seconds / 0.5)):
        desk.send(desk.target(VELOCITY, **velocity))
        out += desk.run(0.5)
    return out


def item(desk, command, north, east, param1=0.0):
    lat, lon = desk.autopilot.origin.to_geodetic(north, east)
    return Item(command, param1=param1, x=round(lat * 1e7), y=round(lon * 1e7))


def square(desk, command, size, north=0.0, east=0.0):
    corners = ((size, size), (size, -size), (-size, -size), (-size, size))
    return [item(desk, command, north + n, east + e, 4) for n, e in corners]


def upload(desk, items):
    desk.autopilot.missions.replace(MissionType.FENCE, items)


# Breaches


@pytest.mark.parametrize(("action", "leads_to"), [(0, GUIDED), (1, RTL), (2, LAND), (4, BRAKE)])
def test_leaving_the_circle_is_told_and_met_with_the_action(quad, texts, action, leads_to):
    put(quad, FENCE_ENABLE=1, FENCE_RADIUS=10, FENCE_ACTION=action)
    quad.fly(5)
    before = push(quad, 3, vx=1.0)
    assert "Circle fence breached" not in texts(before)
    said = texts(push(quad, 8, vx=1.4))
    assert said.count("Circle fence breached") == 1
    assert mode(quad) == leads_to


def test_the_breach_is_noticed_at_the_radius(quad):
    put(quad, FENCE_ENABLE=1, FENCE_RADIUS=5, FENCE_ACTION=0)
    quad.fly(3)
    while not quad.autopilot.fence.breaches.mask:
        quad.send(quad.target(VELOCITY, vx=1.0))
        quad.run(0.05)
    assert 5 <= quad.where.north < 5.3


def test_above_the_highest_is_a_breach_of_its_own_name(quad, texts):
    put(quad, FENCE_ENABLE=1, FENCE_ALT_MAX=6)
    quad.fly(4)
    said = texts(push(quad, 3, vz=-1.5))
    assert "Max Alt fence breached" in said
    assert mode(quad) == RTL
    assert quad.autopilot.fence.breaches.type == mav.FENCE_BREACH_MAXALT


def test_a_return_does_not_climb_through_the_ceiling(quad):
    put(quad, FENCE_ENABLE=1, FENCE_ALT_MAX=8, FENCE_MARGIN=2, RTL_ALT=1500)
    quad.fly(4)
    assert quad.command(SET_MODE, 1, RTL) == ACCEPTED
    highest = 0.0
    for _ in range(100):
        quad.run(0.1)
        highest = max(highest, -quad.where.down)
    assert abs(highest - 6) < 0.3
    assert quad.autopilot.fence.breaches.count == 0


def test_two_fences_left_at_once_are_told_in_one_text(quad, texts):
    put(quad, FENCE_RADIUS=3, FENCE_ALT_MAX=3, FENCE_MARGIN=1, FENCE_ACTION=0)
    quad.fly(5)
    push(quad, 5, vx=1.4)
    put(quad, FENCE_ENABLE=1)
    assert "Max Alt and Circle fences breached" in texts(quad.run(0.3))
    assert quad.autopilot.fence.breaches.type == mav.FENCE_BREACH_BOUNDARY
    assert quad.autopilot.fence.breaches.count == 2


def test_coming_back_is_told_and_the_mode_stays(quad, texts):
    put(quad, FENCE_ENABLE=1, FENCE_RADIUS=8)
    quad.fly(5)
    push(quad, 9, vx=1.4)
    assert mode(quad) == RTL
    said = texts(quad.run(20))
    assert said.count("Fence breach cleared") == 1
    assert mode(quad) == RTL
    assert quad.autopilot.fence.breaches.mask == 0
    assert quad.autopilot.fence.breaches.count >= 1


def test_after_a_breach_guided_may_be_set_again_and_stays(quad, texts):
    put(quad, FENCE_ENABLE=1, FENCE_RADIUS=8)
    quad.fly(5)
    push(quad, 9, vx=1.4)
    assert mode(quad) == RTL
    assert quad.command(SET_MODE, 1, GUIDED) == ACCEPTED
    said = texts(push(quad, 3, vx=1.0))
    assert "Manual recovery started" in said
    assert "Circle fence breached" not in said
    assert mode(quad) == GUIDED


def test_twenty_metres_farther_out_it_is_a_new_breach(quad, texts):
    put(quad, FENCE_ENABLE=1, FENCE_RADIUS=5)
    quad.fly(5)
    push(quad, 6, vx=1.4)
    assert quad.command(SET_MODE, 1, GUIDED) == ACCEPTED
    said = texts(push(quad, 22, vx=1.5))
    assert said.count("Circle fence breached") == 1
    assert mode(quad) == RTL
    assert quad.autopilot.fence.breaches.count == 2


def test_far_outside_it_lands_rather_than_returns(quad):
    quad.fly(5)
    quad.autopilot.set_home(Vec3(200.0, 0.0, 0.0))
    put(quad, FENCE_ENABLE=1, FENCE_RADIUS=50)
    quad.run(0.3)
    assert mode(quad) == LAND


def test_a_rover_returns_or_holds(desk, texts):
    for action, leads_to in ((1, 11), (2, 4)):
        rover = desk("rover")
        put(rover, FENCE_ENABLE=1, FENCE_RADIUS=5, FENCE_ACTION=action, AVOID_ENABLE=0)
        rover.fly()
        said = texts(push(rover, 8, vx=1.0))
        assert "Circle fence breached" in said
        assert mode(rover) == leads_to


def drive_out(rover, how):
    """Stream something that leads north for 20 s."""
    out = []
    for _ in range(40):
        if how == "thrust":
            rover.send(
                mav.MAVLink_set_attitude_target_message(0, 1, 1, 7, [1, 0, 0, 0], 0, 0, 0, 1)
            )
        elif how == "turn":
            rover.send(rover.target(0x5C7, vx=2.0))
        else:
            rover.send(rover.target(VELOCITY, vx=2.0))
        out += rover.run(0.5)
    return out


@pytest.mark.parametrize("how", ["velocity", "turn", "thrust"])
@pytest.mark.parametrize("shape", ["circle", "polygon"])
def test_a_rover_in_guided_stops_before_the_fence(rover, texts, how, shape):
    put(rover, FENCE_ENABLE=1, FENCE_RADIUS=12 if shape == "circle" else 500)
    if shape == "polygon":
        upload(rover, square(rover, INCLUSION, 12))
    rover.fly()
    said = texts(drive_out(rover, how))
    assert not any("breached" in text for text in said)
    assert rover.where.north == pytest.approx(10, abs=0.1), "less FENCE_MARGIN"
    assert mode(rover) == 15
    rover.send(rover.target(VELOCITY, vx=-1.0))
    rover.run(2.9)
    assert rover.where.north < 9, "the way back is free"


def test_a_rover_that_is_outside_already_is_let_alone(rover):
    put(rover, FENCE_ENABLE=1, FENCE_RADIUS=5, FENCE_ACTION=0)
    rover.fly()
    rover.autopilot.set_home(Vec3(-20.0, 0.0, 0.0))
    push(rover, 3, vx=1.0)
    assert rover.where.north > 1


def test_a_rover_has_no_ceiling(rover):
    rover.autopilot.settings.fence.types = 15
    rover.autopilot.settings.fence.enabled = True
    assert rover.autopilot.fence.enabled == 2


def test_the_floor_counts_in_flight_once_the_vehicle_was_above_it(quad, texts):
    put(quad, FENCE_ENABLE=1, FENCE_TYPE=8, FENCE_ALT_MIN=2, FENCE_MARGIN=1)
    quad.fly(5)  # through the floor from below
    assert mode(quad) == GUIDED
    said = texts(push(quad, 6, vz=1.0))
    assert "Min Alt fence breached" in said
    assert mode(quad) == RTL


def test_landing_through_the_floor_is_no_breach(quad, texts):
    put(quad, FENCE_ENABLE=1, FENCE_TYPE=8, FENCE_ALT_MIN=2, FENCE_MARGIN=1)
    quad.fly(5)
    assert quad.command(SET_MODE, 1, LAND) == ACCEPTED
    said = texts(quad.run(20))
    assert not any("fence" in text for text in said)
    assert not quad.autopilot.armed


def test_a_landing_outside_does_not_quieten_the_next_flight(quad, texts):
    put(quad, FENCE_ENABLE=1, FENCE_RADIUS=5, FENCE_ACTION=2)
    quad.fly(3)
    push(quad, 6, vx=1.4)
    assert mode(quad) == LAND
    quad.run(15)
    assert not quad.autopilot.armed
    quad.autopilot.set_home(quad.autopilot.home._replace(north=quad.where.north))
    quad.run(1)
    quad.fly(3)
    assert "Circle fence breached" in texts(push(quad, 8, vx=1.4))
    assert mode(quad) == LAND


def test_a_disarmed_vehicle_outside_says_nothing_and_may_not_arm(quad, texts):
    quad.autopilot.set_home(Vec3(100.0, 0.0, 0.0))
    put(quad, FENCE_ENABLE=1, FENCE_RADIUS=30)
    assert not any("breached" in text for text in texts(quad.run(1)))
    assert quad.command(ARM, 1) == FAILED
    assert "Arm: Vehicle breaching Circle fence" in texts(quad.run(0.1))


# Areas of the list


@pytest.mark.parametrize("turn", [0.0, 0.3, pi / 2, 2.0])
def test_a_polygon_contains_what_it_should_whichever_way_it_is_turned(desk, turn):
    vehicle = desk("rover")
    shape = ((10, 0), (10, 20), (0, 20), (0, 10), (-10, 10), (-10, 0))  # an L

    def turned(n, e):
        return n * cos(turn) - e * sin(turn), n * sin(turn) + e * cos(turn)

    upload(vehicle, [item(vehicle, INCLUSION, *turned(n, e), 6) for n, e in shape])
    areas = Areas()
    areas.follow(vehicle.autopilot.missions.fence, vehicle.autopilot.origin)
    for point, inside in {
        (5, 5): True,
        (5, 15): True,
        (-5, 5): True,
        (-5, 15): False,
        (15, 5): False,
        (5, -1): False,
        (5, 25): False,
    }.items():
        assert areas.allow(turned(*point), any_inclusion=False) is inside


def test_all_inclusions_count_on_ardupilot_and_any_on_px4(desk):
    for autopilot, is_inside in (("ardupilot", False), ("px4", True)):
        vehicle = desk("rover", autopilot=autopilot)
        upload(
            vehicle,
            [item(vehicle, CIRCLE_IN, 0, 0, 20), item(vehicle, CIRCLE_IN, 100, 0, 20)],
        )
        vehicle.autopilot.settings.fence.enabled = True
        vehicle.run(0.3)
        assert bool(vehicle.autopilot.fence.breaches.mask) is not is_inside


def test_leaving_a_polygon_or_entering_an_exclusion_is_a_breach(desk, texts):
    for shapes in (
        lambda v: square(v, INCLUSION, 8),
        lambda v: [item(v, CIRCLE_IN, 0, 0, 8)],
        lambda v: square(v, EXCLUSION, 4, north=12),
        lambda v: [item(v, CIRCLE_OUT, 12, 0, 4)],
    ):
        quad = desk("quadcopter")
        upload(quad, shapes(quad))
        put(quad, FENCE_ENABLE=1)
        quad.fly(4)
        said = texts(push(quad, 10, vx=1.2))
        assert "Polygon fence breached" in said
        assert mode(quad) == RTL


def test_a_new_list_counts_at_once_and_an_empty_one_ends_the_breach(quad, texts):
    put(quad, FENCE_ENABLE=1, FENCE_ACTION=0)
    quad.fly(4)
    upload(quad, square(quad, EXCLUSION, 5))
    assert "Polygon fence breached" in texts(quad.run(0.3))
    upload(quad, [])
    assert "Fence breach cleared" in texts(quad.run(0.3))


# Targets


def test_a_target_beyond_the_fence_is_refused_and_the_vehicle_stays(quad, texts):
    put(quad, FENCE_ENABLE=1, FENCE_RADIUS=10, FENCE_ALT_MAX=8)
    quad.fly(3)
    for place in ({"x": 20.0, "z": -3.0}, {"x": 1.0, "z": -9.0}):
        quad.send(quad.target(POSITION, **place))
        said = texts(quad.run(3))
        assert any("beyond the" in text for text in said)
        assert hypot(quad.where.north, quad.where.east) < 0.5
        assert abs(quad.where.down + 3) < 0.5
    quad.send(quad.target(POSITION, x=5.0, z=-3.0))
    quad.run(8)
    assert abs(quad.where.north - 5) < 0.5


def test_what_is_beyond_is_named(quad):
    put(quad, FENCE_ENABLE=1, FENCE_RADIUS=10)
    upload(quad, square(quad, EXCLUSION, 2, north=5))
    fence = quad.autopilot.fence
    assert fence.refusal(Vec3(0.0, 0.0, -3.0)) is None
    assert fence.refusal(Vec3(10.0, 0.0, -3.0)) is None  # on the line
    assert fence.refusal(Vec3(11.0, 0.0, -3.0)) == "beyond the Circle fence"
    assert fence.refusal(Vec3(5.0, 0.0, -3.0)) == "beyond the Polygon fence"
    assert fence.refusal(Vec3(11.0, 0.0, -200.0)) == "beyond the Max Alt and Circle fences"


def test_a_takeoff_through_the_ceiling_is_a_breach_and_nothing_worse(quad, texts):
    put(quad, FENCE_ENABLE=1, FENCE_ALT_MAX=6, FENCE_ACTION=0)
    quad.fly(10)
    quad.run(5)
    assert abs(quad.where.down + 10) < 0.5
    assert quad.autopilot.fence.breaches.mask == 1


def test_without_a_fence_every_target_will_do(quad):
    assert quad.autopilot.fence.refusal(Vec3(1e6, 1e6, -1e6)) is None


# Arming


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"FENCE_RADIUS": 5, "FENCE_MARGIN": 10}, "Circle FENCE_MARGIN is less than FENCE_RADIUS"),
        ({"FENCE_ALT_MAX": 5, "FENCE_ALT_MIN": 8}, "FENCE_ALT_MAX < FENCE_ALT_MIN"),
        ({"FENCE_ALT_MAX": 5, "FENCE_ALT_MIN": 2}, "FENCE_MARGIN too big"),
        ({"FENCE_TYPE": 4}, "Fences enabled, but none selected"),
    ],
)
def test_a_fence_that_makes_no_sense_forbids_arming(quad, texts, values, reason):
    put(quad, FENCE_ENABLE=1, **values)
    assert quad.command(ARM, 1) == FAILED
    said = "".join(texts(quad.run(0.1)))  # longer than one STATUSTEXT
    assert f"Arm: {reason}" in said


def test_an_inclusion_circle_narrower_than_the_margin_forbids_arming(quad):
    put(quad, FENCE_ENABLE=1)
    upload(quad, [item(quad, CIRCLE_IN, 0, 0, 1.5)])
    reason = "Polygon fence margin is less than inclusion circle radius"
    assert quad.autopilot.fence.arming_refusal() == reason


# DO_FENCE_ENABLE


def test_the_fence_is_switched_by_command_until_the_parameter_changes(quad):
    fence = quad.autopilot.fence
    assert not fence.enabled
    assert quad.command(FENCE_ENABLE, 1) == ACCEPTED
    assert fence.enabled == 3  # height and circle; there is no list
    assert quad.autopilot.parameters["FENCE_ENABLE"] == 0
    assert quad.command(FENCE_ENABLE, 0, 2) == ACCEPTED
    assert fence.enabled == 1
    assert quad.command(FENCE_ENABLE, 0) == ACCEPTED
    assert not fence.enabled
    put(quad, FENCE_ENABLE=1)
    quad.run(0.3)
    assert fence.enabled == 3


def test_switching_off_ends_a_breach(quad, texts):
    quad.fly(5)
    push(quad, 5, vx=1.4)
    put(quad, FENCE_ENABLE=1, FENCE_RADIUS=3, FENCE_ACTION=0)
    assert "Circle fence breached" in texts(quad.run(0.3))
    assert quad.command(FENCE_ENABLE, 0) == ACCEPTED
    quad.run(0.3)
    assert quad.autopilot.fence.breaches.mask == 0


@pytest.mark.parametrize("what", [3, -1, 99])
def test_other_values_of_fence_enable_are_denied(quad, what):
    assert quad.command(FENCE_ENABLE, what) == DENIED


def test_switching_on_a_fence_that_is_not_there_fails(quad):
    put(quad, FENCE_TYPE=4)
    assert quad.command(FENCE_ENABLE, 1) == FAILED


# PX4


def test_px4_tells_a_breach_in_its_own_words_and_holds(desk, texts):
    quad = desk("quadcopter", autopilot="px4")
    put(quad, GF_MAX_HOR_DIST=5)
    autopilot = quad.autopilot
    autopilot.set_home(Vec3(0.0, 0.0, 0.0))
    stream = quad.target(VELOCITY, vz=-1.0)
    for _ in range(10):
        quad.send(stream)
        quad.run(0.1)
    assert quad.command(SET_MODE, 1, 6) == ACCEPTED
    assert quad.command(ARM, 1) == ACCEPTED
    for _ in range(8):
        quad.send(stream)
        quad.run(0.5)
    said = texts(push(quad, 8, vx=1.4))
    assert "Geofence: exceeding maximum distance to Home" in said
    assert "Failsafe activated" in said
    assert mode(quad) == 0x3040000


def test_px4_has_no_fence_until_a_distance_is_set(desk):
    quad = desk("quadcopter", autopilot="px4")
    assert not quad.autopilot.fence.enabled
    assert quad.autopilot.fence.arming_refusal() is None


# Hostile


def test_endless_breaches_do_not_overflow_fence_status(quad):
    breaches = quad.autopilot.fence.breaches
    for i in range(140_000):
        breaches.note({2: 1.0} if i % 2 else {}, float(i))
    assert breaches.count == 65_500


def test_positions_without_end_are_refused_and_do_not_raise(quad):
    put(quad, FENCE_ENABLE=1)
    upload(quad, square(quad, INCLUSION, 10))
    for value in (1e9, -1e9, inf, -inf):
        assert quad.autopilot.fence.refusal(Vec3(value, value, value)) is not None
