"""AUTO flies the mission: in order, to the places, with the messages that clients wait for."""

from math import cos, degrees, hypot, pi, radians, sin

import pytest

from mavherd.transport.frames import wrap_angle, yaw_of
from mavherd.transport.mavlink import mav
from mavherd.vehicles.missions.items import Item
from mavherd.vehicles.missions.plan import Plan

ACCEPTED, DENIED, FAILED = 0, 2, 4
ARM, START, SET_CURRENT, SET_MODE, CONDITION_YAW, PAUSE = 400, 300, 224, 176, 115, 193
AUTO = {"quadcopter": 3, "rover": 10}
NOT_STARTED, ACTIVE, PAUSED, COMPLETE, NO_MISSION = 2, 3, 4, 5, 1


class Flight:
    """A vehicle on a desk, its mission in metres, and everything that it has sent."""

    def __init__(self, desk, kind="quadcopter", **config):
        config.setdefault("profile", "ardupilot")
        self.desk = desk(kind, **config)
        self.kind = kind
        self.autopilot = self.desk.autopilot
        self.sent = []

    def at(self, command, north=0.0, east=0.0, up=0.0, frame=3, **params):
        """Return an item with a place, in metres from the origin."""
        lat, lon = self.autopilot.origin.to_geodetic(north, east)
        return Item(command, frame, x=round(lat * 1e7), y=round(lon * 1e7), z=up, **params)

    def load(self, *items):
        self.desk.vehicle.missions.load(Plan(items))
        return self

    def set_auto(self):
        return self.desk.command(SET_MODE, 1, AUTO[self.kind])

    def start(self):
        """Arm in AUTO; a copter needs MISSION_START as well."""
        assert self.set_auto() == ACCEPTED
        assert self.desk.command(ARM, 1) == ACCEPTED
        if self.kind == "quadcopter":
            assert self.desk.command(START) == ACCEPTED
        return self

    def run(self, seconds):
        messages = self.desk.run(seconds)
        self.sent += messages
        return messages

    def until(self, condition, most=120.0):
        """Let time pass until `condition()`; fail when it does not come true."""
        begin = self.desk.now
        while not condition():
            assert self.desk.now - begin < most, self.texts
            self.run(0.1)
        return self.desk.now - begin

    def until_reached(self, seq, most=120.0):
        return self.until(lambda: seq in self.reached, most)

    @property
    def where(self):
        return self.desk.where

    @property
    def reached(self):
        return [m.seq for m in self.sent if m.get_type() == "MISSION_ITEM_REACHED"]

    @property
    def current(self):
        """Return the numbers of MISSION_CURRENT as they changed."""
        seqs = [m.seq for m in self.sent if m.get_type() == "MISSION_CURRENT"]
        return [s for i, s in enumerate(seqs) if i == 0 or s != seqs[i - 1]]

    @property
    def texts(self):
        return [m.text for m in self.sent if m.get_type() == "STATUSTEXT"]

    def mission_current(self):
        """Return MISSION_CURRENT, asked for."""
        wanted = mav.MAVLINK_MSG_ID_MISSION_CURRENT
        (_, message) = self.desk.ask(mav.MAV_CMD_REQUEST_MESSAGE, wanted)
        return message

    def distance(self, north, east, up=None):
        k = self.where
        rise = 0.0 if up is None else k.down + up
        return hypot(k.north - north, k.east - east, rise)

    def yaw_deg(self):
        return degrees(yaw_of(self.where[6:10])) % 360


@pytest.fixture
def copter(desk):
    return Flight(desk)


@pytest.fixture
def rover(desk):
    return Flight(desk, "rover")


def takeoff(up=10.0):
    return Item(22, 3, z=up)


# A whole mission


def test_a_copter_flies_takes_off_flies_and_lands(copter):
    c = copter
    c.load(takeoff(), c.at(16, 20, 0, 10), c.at(16, 20, 20, 15), Item(20)).start()
    c.until_reached(1, 15)
    assert c.distance(0, 0, 10) < 0.5
    c.until_reached(2, 15)
    assert c.distance(20, 0, 10) < 2.2
    c.until_reached(3, 15)
    assert c.distance(20, 20, 15) < 2.2
    c.until(lambda: not c.autopilot.armed)
    assert c.distance(0, 0, 0) < 0.5
    assert c.reached == [1, 2, 3, 4]
    assert "Mission: 1 Takeoff" in c.texts
    assert "Mission: 2 WP" in c.texts
    assert "Reached command #2" in c.texts
    assert "Mission: 4 RTL" in c.texts
    assert c.current[:4] == [1, 2, 3, 4]
    assert c.mission_current().mission_state == COMPLETE


def test_a_rover_drives_its_waypoints_and_stops(rover):
    r = rover
    r.load(r.at(16, 10, 0), r.at(16, 10, 10), r.at(16, 0, 10)).start()
    r.until_reached(3, 60)
    r.run(6)
    assert r.reached == [1, 2, 3]
    assert r.distance(0, 10) < 0.3
    assert hypot(*r.where[3:6]) < 0.02
    assert r.autopilot.armed
    assert "Reached waypoint #2" in r.texts
    assert r.texts[-1] == "Mission Complete"


def test_heights_are_kept_through_climbs_and_the_return(copter):
    c = copter
    c.load(takeoff(6), c.at(16, 22, 0, 6), c.at(16, 44, 0, 8), Item(20))
    c.desk.fly(5)
    c.set_auto()
    highest = 0.0
    while c.autopilot.armed:
        c.run(0.5)
        highest = max(highest, -c.where.down)
        assert c.desk.now < 120
    assert 14.8 < highest < 15.5  # RTL_ALT


def test_messages_come_once(copter):
    c = copter
    c.load(takeoff(5), c.at(16, 6, 0, 5), c.at(16, 12, 0, 5)).start()
    c.until_reached(3)
    c.run(5)
    assert c.reached == [1, 2, 3]
    assert c.texts.count("Reached command #2") == 1
    assert c.autopilot.mode.name == "AUTO"
    assert c.distance(12, 0, 5) < 0.5  # stays at the last waypoint
    assert c.mission_current().mission_state == COMPLETE


def test_mission_current_tells_the_state(copter):
    c = copter
    m = c.mission_current()
    assert (m.seq, m.total, m.mission_state, m.mission_mode) == (0, 65535, NO_MISSION, 2)
    c.load(takeoff(5), c.at(17, 0, 0, 5))
    m = c.mission_current()
    assert (m.seq, m.total, m.mission_state) == (0, 2, NOT_STARTED)
    c.start().run(1)
    m = c.mission_current()
    assert (m.seq, m.mission_state, m.mission_mode) == (1, ACTIVE, 1)
    c.until_reached(1)
    c.desk.command(SET_MODE, 1, 4)
    m = c.mission_current()
    assert (m.seq, m.mission_state, m.mission_mode) == (2, PAUSED, 2)


# Starting


def test_a_copter_waits_for_mission_start(copter):
    c = copter
    c.load(takeoff(5))
    assert c.set_auto() == ACCEPTED
    assert c.desk.command(ARM, 1) == ACCEPTED
    c.run(5)
    assert c.where.down == 0
    assert c.desk.command(START) == ACCEPTED
    c.until_reached(1, 15)


def test_a_copter_that_nobody_starts_disarms_itself(copter):
    c = copter
    c.load(takeoff(5)).set_auto()
    c.desk.command(ARM, 1)
    c.run(11)
    assert not c.autopilot.armed


def test_a_raised_throttle_starts_the_mission_as_mission_start_does(copter):
    c = copter
    c.load(takeoff(5)).set_auto()
    c.desk.command(ARM, 1)
    low, raised = (mav.MAVLink_manual_control_message(1, 0, 0, z, 0, 0) for z in (0, 500))
    for message, most in ((low, 0.0), (raised, 0.5)):
        for _ in range(15):
            c.desk.send(message)
            c.run(0.3)
        assert (-c.where.down > most) == (message is raised)


def test_mission_start_enters_auto_from_another_mode(copter):
    c = copter
    c.load(takeoff(5))
    c.desk.command(SET_MODE, 1, 4)
    c.desk.command(ARM, 1)
    assert c.desk.command(START) == ACCEPTED
    assert c.autopilot.mode.name == "AUTO"
    c.until_reached(1, 15)


def test_a_start_before_arming_counts_when_armed_in_auto(copter):
    c = copter
    c.load(takeoff(5))
    assert c.desk.command(START) == ACCEPTED
    c.desk.command(ARM, 1)
    c.until_reached(1, 15)


def test_a_start_before_arming_is_forgotten_in_another_mode(copter):
    c = copter
    c.load(takeoff(5))
    c.desk.command(START)
    c.desk.command(SET_MODE, 1, 4)
    c.desk.command(ARM, 1)
    c.set_auto()
    c.run(3)
    assert c.where.down == 0


def test_auto_entered_in_the_air_starts_at_once(copter):
    c = copter
    c.load(takeoff(8), c.at(16, 10, 0, 8))
    c.desk.fly(5)
    assert c.set_auto() == ACCEPTED
    c.until_reached(2, 20)
    assert c.distance(10, 0, 8) < 2.2


def test_a_reboot_keeps_the_mission_and_forgets_the_place_in_it(rover):
    r = rover
    r.load(r.at(16, 6, 0), r.at(16, 0, 0), r.at(16, 0, 6)).start()
    r.until_reached(2)
    r.desk.command(ARM, 0)
    assert r.desk.command(246, 1) == ACCEPTED
    r.run(1)
    m = r.mission_current()
    assert (m.seq, m.total, m.mission_state) == (0, 3, NOT_STARTED)


def test_a_px4_mission_starts_when_armed_and_counts_from_0(desk):
    c = Flight(desk, autopilot="px4")
    c.load(takeoff(5), c.at(16, 6, 0, 5))
    assert c.desk.command(SET_MODE, 1, 4, 4) == ACCEPTED
    assert c.desk.command(ARM, 1) == ACCEPTED
    c.until_reached(1, 30)
    assert c.reached == [0, 1]


def test_a_px4_mission_of_waypoints_takes_off_by_itself(desk):
    c = Flight(desk, autopilot="px4")
    c.load(c.at(16, 3, 0, 5))
    c.desk.command(SET_MODE, 1, 4, 4)
    c.desk.command(ARM, 1)
    c.until_reached(0, 20)
    assert -c.where.down > 2.5


def test_a_rover_enters_auto_with_a_mission_only(desk):
    f = Flight(desk, "rover")
    assert f.set_auto() == FAILED
    f.run(0.1)
    assert any("AUTO failed: no mission" in text for text in f.texts)
    f.load(f.at(16, 3, 0, 0))
    assert f.set_auto() == ACCEPTED


def test_a_copter_needs_a_mission_to_arm_in_auto(desk):
    f = Flight(desk)
    assert f.set_auto() == ACCEPTED
    assert f.desk.command(ARM, 1) == FAILED
    f.run(0.1)
    assert "Arm: Mode requires mission" in f.texts
    assert f.desk.command(START) == FAILED


def test_a_start_names_an_item_of_the_list(copter):
    c = copter
    c.load(takeoff(5), c.at(16, 8, 0, 5), c.at(16, 0, 8, 5))
    for params in ((9,), (float("nan"),), (0, 2), (0, float("inf")), (1e30,), (-4,)):
        assert c.desk.command(START, *params) == DENIED, params
    c.desk.fly(5)
    assert c.desk.command(START, 3, 3) == ACCEPTED
    c.until_reached(3, 20)
    assert c.reached == [3]


# Pausing, going on, other items


def test_leaving_auto_pauses_and_coming_back_resumes_the_item(copter):
    c = copter
    c.load(takeoff(5), c.at(16, 30, 0, 5), c.at(16, 30, 10, 5)).start()
    c.until(lambda: c.where.north > 8)
    c.desk.command(SET_MODE, 1, 17)
    c.run(4)
    assert c.where.north < 28
    c.set_auto()
    c.until_reached(3)
    assert c.reached == [1, 2, 3]
    assert c.texts.count("Mission: 2 WP") == 2


def test_mis_restart_begins_anew(copter):
    c = copter
    c.autopilot.settings.mission_restart = True
    c.load(takeoff(5), c.at(16, 6, 0, 5), c.at(16, 30, 0, 5)).start()
    c.until_reached(2)
    c.desk.command(SET_MODE, 1, 17)
    c.run(1)
    c.set_auto()
    c.until_reached(3)
    assert c.reached == [1, 2, 1, 2, 3]


def test_a_completed_mission_begins_anew(copter):
    c = copter
    c.load(takeoff(5), c.at(16, 6, 0, 5)).start()
    c.until_reached(2)
    c.run(1)
    c.desk.command(SET_MODE, 1, 4)
    c.run(0.1)
    c.set_auto()
    c.until(lambda: c.reached == [1, 2, 1, 2])


def test_disarming_goes_back_to_the_beginning(copter):
    c = copter
    c.load(takeoff(5), c.at(21, 4, 0)).start()
    c.until(lambda: not c.autopilot.armed)
    assert c.distance(4, 0, 0) < 0.7
    c.start()
    c.until(lambda: c.reached[2:] == [1])


@pytest.mark.parametrize("by", ["message", "command"])
def test_another_item_can_be_made_current(copter, by):
    c = copter
    c.load(takeoff(5), c.at(16, 40, 0, 5), c.at(16, 0, 6, 5), c.at(16, 0, 12, 5)).start()
    c.until_reached(1)
    if by == "message":
        c.desk.send(mav.MAVLink_mission_set_current_message(1, 1, 3))
    else:
        assert c.desk.command(SET_CURRENT, 3) == ACCEPTED
    c.until_reached(4)
    assert c.reached == [1, 3, 4]


def test_making_an_item_current_that_is_not_there_fails(copter):
    c = copter
    c.load(takeoff(5))
    for seq in (2, 99, -1, float("nan"), 1e20):
        assert c.desk.command(SET_CURRENT, seq) in (DENIED, FAILED)


def test_a_completed_mission_goes_on_from_another_item(copter):
    c = copter
    c.load(takeoff(5), c.at(16, 6, 0, 5), c.at(16, 0, 0, 5)).start()
    c.until_reached(3)
    c.run(2)
    c.desk.command(SET_CURRENT, 2)
    c.until(lambda: c.reached == [1, 2, 3, 2, 3])


def test_a_shorter_mission_uploaded_in_flight_ends_after_the_item_under_way(copter):
    c = copter
    c.load(takeoff(5), c.at(16, 6, 0, 5), c.at(16, 16, 0, 5), c.at(16, 40, 0, 5)).start()
    c.until_reached(2)
    c.desk.vehicle.missions.mission.replace((takeoff(5),))
    c.run(15)
    assert c.distance(16, 0, 5) < 0.5
    assert c.reached == [1, 2, 3]
    assert c.mission_current().mission_state == COMPLETE


def test_a_changed_item_is_flown_anew(copter):
    c = copter
    c.load(takeoff(5), c.at(16, 40, 0, 5)).start()
    c.until_reached(1)
    c.run(1)
    c.desk.vehicle.missions.mission.replace((takeoff(5), c.at(16, 0, 8, 5)))
    c.until_reached(2, 15)
    assert c.distance(0, 8, 5) < 2.2


def test_an_emptied_mission_does_not_stop_the_flight_in_mid_air(copter):
    c = copter
    c.load(takeoff(5), c.at(16, 10, 0, 5), Item(178, param1=1, param2=2), Item(20)).start()
    c.until_reached(1)
    c.desk.vehicle.missions.mission.replace(())
    c.run(15)
    assert c.distance(10, 0, 5) < 0.5


# NAV items


def test_a_waypoint_is_held_as_long_as_it_says(copter):
    c = copter
    c.load(takeoff(5), c.at(16, 8, 0, 5, param1=4), c.at(16, 8, 8, 5)).start()
    c.until_reached(1)
    c.until(lambda: c.distance(8, 0, 5) < 2)
    assert 3.7 < c.until_reached(2) < 4.4
    assert c.distance(8, 0, 5) < 0.3


def test_the_acceptance_radius_counts(copter):
    c = copter
    c.load(takeoff(5), c.at(16, 20, 0, 5, param2=8), c.at(16, 0, 0, 5)).start()
    c.until_reached(2)
    assert 6 < c.distance(20, 0, 5) < 8.1


def test_heights_are_above_home_or_above_the_sea(copter):
    c = copter
    c.load(takeoff(5), c.at(16, 3, 0, 8), c.at(16, 3, 0, 488 + 12.0, frame=0, param1=3)).start()
    c.until_reached(2)
    assert 6.0 < -c.where.down < 9
    c.until_reached(3)
    assert abs(c.where.down + 12) < 0.5


def test_a_height_of_0_keeps_the_present_one(copter):
    c = copter
    c.load(takeoff(6), c.at(16, 10, 0, 0, param1=2)).start()
    c.until_reached(2)
    assert abs(c.where.down + 6) < 0.5


def test_the_nose_shows_the_way(copter):
    c = copter
    c.load(takeoff(5), c.at(16, 0, 30, 5)).start()
    c.until(lambda: c.where.east > 10)
    assert abs(c.yaw_deg() - 90) < 5


def test_loiter_time_stays_for_its_seconds(copter):
    c = copter
    c.load(takeoff(5), c.at(19, 6, 0, 5, param1=5), c.at(16, 0, 0, 5)).start()
    c.until(lambda: c.distance(6, 0, 5) < 2)
    assert 4.7 < c.until_reached(2) < 5.5


def test_loiter_unlimited_stays_until_told_otherwise(copter):
    c = copter
    c.load(takeoff(5), c.at(17, 6, 0, 5), c.at(16, 0, 6, 5)).start()
    c.run(60)
    assert c.reached == [1]
    assert c.distance(6, 0, 5) < 0.3
    c.desk.command(SET_CURRENT, 3)
    c.until_reached(3)


@pytest.mark.parametrize("radius", [8.0, -8.0])
def test_loiter_turns_fly_circles_to_the_side_of_the_radius(copter, radius):
    c = copter
    c.load(takeoff(5), c.at(18, 20, 0, 5, param1=2, param3=radius), c.at(16, 0, 0, 5)).start()
    c.until(lambda: c.distance(20, 0) < 10.5)
    c.run(4)  # on the circle by now
    turned, k = 0.0, c.where
    while 2 not in c.reached:
        before = k
        c.run(0.2)
        k = c.where
        if 2 not in c.reached:
            assert abs(c.distance(20, 0) - 8) < 1.2
            towards = wrap_angle(yaw_of(k[6:10]) - pi)  # where the centre sees it
            assert abs(wrap_angle(_bearing(k) - towards)) < 0.5
        turned += wrap_angle(_bearing(k) - _bearing(before))
        assert c.desk.now < 180
    assert turned * radius > 0
    assert 2.5 * pi < abs(turned) < 4.3 * pi


def _bearing(k, north=20.0):
    from math import atan2

    return atan2(k.east, k.north - north)


def test_a_rover_drives_circles_too(rover):
    r = rover
    r.load(r.at(18, 8, 0, param1=1, param3=4), r.at(16, 0, 0)).start()
    r.until_reached(1, 120)
    assert abs(r.distance(8, 0) - 4) < 2.1
    r.until_reached(2, 60)


def test_land_lands_at_its_place_and_disarms(copter):
    c = copter
    c.load(takeoff(6), c.at(21, 8, 4)).start()
    c.until(lambda: not c.autopilot.armed, 60)
    assert c.distance(8, 4, 0) < 0.7
    assert c.reached == [1, 2]


def test_land_without_a_place_lands_here(copter):
    c = copter
    c.load(takeoff(6), Item(21)).start()
    c.until(lambda: not c.autopilot.armed, 40)
    assert c.distance(0, 0, 0) < 0.3


def test_a_takeoff_after_a_landing_goes_on(copter):
    c = copter
    c.load(takeoff(5), Item(21), takeoff(4), Item(21)).start()
    c.until(lambda: not c.autopilot.armed, 90)
    assert c.reached == [1, 2, 3, 4]
    assert [t for t in c.texts if "armed" in t or "rming" in t] == [
        "Arming motors",
        "Disarming motors",
    ]


def test_a_delay_waits(copter):
    c = copter
    c.load(takeoff(5), Item(93, param1=3), c.at(16, 5, 0, 5)).start()
    c.until_reached(1)
    assert 2.7 < c.until_reached(2) < 3.4
    assert c.distance(0, 0, 5) < 0.5


def test_a_rover_returns_home_in_a_mission(rover):
    r = rover
    r.load(r.at(16, 8, 0), Item(20)).start()
    r.until_reached(2, 60)
    r.run(5)
    assert r.distance(0, 0) < 0.3


def test_a_takeoff_in_the_air_never_goes_down(copter):
    c = copter
    c.load(takeoff(3), c.at(16, 6, 0, 8))
    c.desk.fly(8)
    c.set_auto()
    while 2 not in c.reached:
        c.run(0.1)
        assert c.where.down < -7


# DO and CONDITION items


def test_a_jump_repeats_a_part(rover):
    r = rover
    r.load(r.at(16, 5, 0), r.at(16, 0, 0), Item(177, param1=1, param2=2), r.at(16, 0, 5)).start()
    r.until_reached(4, 120)
    assert r.reached == [1, 2, 1, 2, 1, 2, 4]


def test_the_speed_changes_for_the_next_leg(copter):
    c = copter
    slow, fast = Item(178, param1=1, param2=1.0), Item(178, param1=1, param2=-2)
    c.load(takeoff(5), slow, c.at(16, 12, 0, 5), fast, c.at(16, 60, 0, 5)).start()
    c.until(lambda: c.where.north > 5)
    assert abs(c.where.v_north - 1) < 0.15
    c.until(lambda: c.where.north > 35)
    assert c.where.v_north > 3
    assert "Mission: 2 ChangeSpeed" in c.texts


def test_the_first_do_item_is_begun_before_the_leg_as_by_ardupilot(copter):
    c = copter
    c.load(takeoff(5), c.at(16, 5, 0, 5), Item(178, param1=1, param2=3), c.at(16, 9, 0, 5)).start()
    c.until_reached(4)
    said = ["Reached command #2", "Mission: 3 ChangeSpeed", "Mission: 4 WP"]
    assert [text for text in c.texts if text in said] == said
    assert c.reached == [1, 2, 3, 4]


@pytest.mark.parametrize("kind", ["quadcopter", "rover"])
def test_a_paused_mission_holds_and_goes_on(desk, kind):
    f = Flight(desk, kind)
    f.load(*([takeoff(5)] if kind == "quadcopter" else []), f.at(16, 40, 0, 5)).start()
    f.until(lambda: f.where.north > 10)
    assert f.desk.command(PAUSE, 0) == ACCEPTED
    assert f.mission_current().mission_state == PAUSED
    f.run(6)
    assert hypot(f.where.v_north, f.where.v_east) < 0.05
    assert f.where.north < 25
    assert f.desk.command(PAUSE, 1) == ACCEPTED
    assert f.mission_current().mission_state == ACTIVE
    f.until(lambda: f.distance(40, 0) < 3)


def test_climb_and_descent_speeds_change(copter):
    c = copter
    c.load(
        Item(178, param1=2, param2=1.0),
        takeoff(9),
        Item(178, param1=3, param2=0.5),
        c.at(16, 0, 0, 3),
    )
    c.start()
    c.until(lambda: c.where.down < -4)
    assert abs(c.where.v_down + 1.0) < 0.15
    c.until_reached(2)
    c.run(4)
    assert abs(c.where.v_down - 0.5) < 0.1


def test_a_pause_keeps_the_speed_of_the_mission(copter):
    c = copter
    c.load(takeoff(5), Item(178, param1=1, param2=1.0), c.at(16, 30, 0, 5)).start()
    c.until(lambda: c.where.north > 3)
    c.desk.command(SET_MODE, 1, 17)
    c.run(2)
    c.set_auto()
    c.run(4)
    assert abs(c.where.v_north - 1) < 0.15


def test_condition_delay_holds_up_the_next_do(copter):
    c = copter
    c.load(
        takeoff(5), Item(112, param1=3), Item(178, param1=1, param2=0.7), c.at(16, 60, 0, 5)
    ).start()
    c.until_reached(1)
    assert 2.8 < c.until(lambda: c.autopilot.robot.speed_limit == 0.7) < 3.3
    assert c.where.north > 4  # it flew on meanwhile


def test_condition_distance_waits_until_the_waypoint_is_near(copter):
    c = copter
    c.load(
        takeoff(5), Item(114, param1=10), Item(178, param1=1, param2=0.7), c.at(16, 30, 0, 5)
    ).start()
    c.until(lambda: c.autopilot.robot.speed_limit == 0.7)
    assert 19.5 < c.where.north < 22


def test_what_a_condition_still_holds_up_is_dropped_with_its_leg(copter):
    c = copter
    c.load(takeoff(5), Item(112, param1=500), Item(178, param1=1, param2=0.7), c.at(16, 5, 0, 5))
    c.start()
    c.until_reached(4)
    c.run(2)
    assert c.autopilot.robot.speed_limit is None
    assert c.reached == [1, 4]


@pytest.mark.parametrize(
    ("params", "expected"), [((200, 30, 0, 0), 200), ((90, 30, -1, 1), 270), ((45, 30, 1, 1), 45)]
)
def test_condition_yaw_turns_the_nose(copter, params, expected):
    c = copter
    yaw = Item(115, 3, *map(float, params))
    c.load(takeoff(5), yaw, c.at(19, 0, 0, 5, param1=30)).start()
    c.until_reached(2, 40)
    c.run(2)
    assert abs((c.yaw_deg() - expected + 180) % 360 - 180) < 4


def test_a_region_of_interest_draws_the_nose_until_it_is_taken_back(copter):
    c = copter
    interest = c.at(195, 0, 40, 0)
    c.load(takeoff(5), interest, c.at(16, 40, 0, 5), Item(197), c.at(16, 80, 0, 5)).start()
    c.until_reached(3)
    assert abs(c.yaw_deg() - 135) < 8
    c.until(lambda: c.where.north > 60)
    assert abs((c.yaw_deg() + 180) % 360 - 180) < 8


def test_the_condition_yaw_command_turns_in_auto_until_the_next_leg(copter):
    c = copter
    c.load(takeoff(5), c.at(17, 0, 0, 5)).start()
    c.until_reached(1)
    assert c.desk.command(CONDITION_YAW, 120, 60, 1, 0) == ACCEPTED
    c.run(6)
    assert abs(c.yaw_deg() - 120) < 4


def test_set_home_moves_home(copter):
    c = copter
    here, there = Item(179, param1=1), c.at(179, -5, 3, 490.0, frame=0)
    c.load(takeoff(5), c.at(16, 8, 0, 5, param1=1), here, c.at(16, 0, 0, 5), there).start()
    c.until_reached(2)
    c.run(0.3)
    assert hypot(c.autopilot.home.north - 8, c.autopilot.home.east) < 0.7
    c.until_reached(5)
    c.run(0.3)
    assert c.autopilot.home == pytest.approx((-5, 3, -2), abs=0.05)


def test_items_without_effect_are_passed_over(copter):
    c = copter
    cameras = [Item(n) for n in (203, 205, 206, 2000, 2500)]
    c.load(takeoff(5), *cameras, c.at(16, 5, 0, 5)).start()
    c.until_reached(7)
    assert c.reached == [1, *range(2, 8)]


def test_do_items_at_the_end_are_run(rover):
    r = rover
    r.load(r.at(16, 5, 0), Item(178, param1=1, param2=0.5)).start()
    r.until_reached(2)
    assert r.autopilot.robot.speed_limit == 0.5


# Nonsense


def test_a_ring_of_jumps_ends_without_a_flood(copter):
    c = copter
    c.load(takeoff(3), Item(178, param1=1, param2=3), Item(177, param1=2, param2=-1)).start()
    c.until_reached(1)
    messages = c.run(1)
    assert len(messages) < 250
    c.run(10)
    assert c.mission_current().mission_state == COMPLETE
    assert c.autopilot.in_air


def test_waypoints_where_it_stands_with_a_jump_for_ever_are_no_flood(rover):
    r = rover
    r.load(r.at(16, 0, 0), Item(177, param1=1, param2=-1)).start()
    r.run(5)
    assert 20 < len(r.reached) <= 51


def test_a_place_on_the_other_side_of_the_world_is_flown_towards(copter):
    c = copter
    c.load(takeoff(5), Item(16, 3, x=-470_000_000, y=-1_714_000_000, z=5.0)).start()
    c.run(25)
    k = c.where
    assert hypot(k.north, k.east) > 30
    assert abs(k.down + 5) < 1
    assert all(abs(v) < 100 for v in (cos(radians(c.yaw_deg())), sin(k.qw)))
