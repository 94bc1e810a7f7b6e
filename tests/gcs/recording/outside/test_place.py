"""Vehicles with local frames of their own are brought into one."""

import pytest

from mavherd.gcs.recording.outside.place import OwnFrame, local_spot, to_enu
from mavherd.transport.frames import Origin
from mavherd.transport.mavlink import mav

HERE = Origin(47.3977, 8.5456, 488.0)
THERE = Origin(47.39860, 8.54760, 490.0)


def told(of, messages, frame):
    """Have a frame hear a vehicle's positions; return the last of each kind."""
    last = None
    for now, m in messages:
        if m.get_type() == "LOCAL_POSITION_NED":
            last = local_spot(m)
            frame.hear_local(last.local, 0.0, now)
        elif m.get_type() == "GLOBAL_POSITION_INT":
            frame.hear_global(m, now)
    return last


def test_two_positions_together_tell_where_a_frame_begins(desk, heard, of):
    frame = OwnFrame()
    far = desk("rover", origin=THERE, north=40.0, east=-25.0)
    told(of, heard(2.0, far), frame)
    north, east = THERE.from_geodetic(frame.origin.lat_deg, frame.origin.lon_deg)
    assert (north, east) == pytest.approx((0, 0), abs=0.02)


def test_a_vehicle_with_another_origin_is_where_it_truly_is(desk, heard, of):
    frame = OwnFrame()
    spot = told(of, heard(2.0, desk("rover", origin=THERE, north=3.0, east=4.0)), frame)
    north, east = HERE.from_geodetic(*THERE.to_geodetic(3.0, 4.0))
    assert to_enu(spot, frame.origin, HERE) == pytest.approx((east, north, 0), abs=0.03)


def test_gps_global_origin_leaves_no_doubt(desk, heard, of):
    frame = OwnFrame()
    frame.hear_origin(mav.MAVLink_gps_global_origin_message(473977000, 85456000, 488000))
    told(of, heard(2.0, desk("rover", origin=THERE)), frame)
    assert (frame.origin.lat_deg, frame.origin.lon_deg) == pytest.approx((47.3977, 8.5456))


def test_degrees_of_zero_are_no_place():
    frame = OwnFrame()
    m = mav.MAVLink_global_position_int_message(0, 0, 0, 0, 0, 0, 0, 0, 0)
    assert frame.hear_global(m, 0.0) is None
    assert frame.landmark(100.0) is None


def test_a_vehicle_that_tells_degrees_only_gives_a_landmark_after_a_while():
    frame = OwnFrame()
    m = mav.MAVLink_global_position_int_message(
        0, 473977000, 85456000, 490000, 2000, 0, 0, 0, 65535
    )
    spot = frame.hear_global(m, 1.0)
    assert frame.landmark(1.5) is None
    mark = frame.landmark(9.0)
    assert (mark.lat_deg, mark.alt_m) == (47.3977, 488.0)
    assert to_enu(spot, None, mark) == (0, 0, 2.0)


def test_what_is_at_the_other_end_of_the_world_is_not_drawn():
    spot = local_spot(mav.MAVLink_local_position_ned_message(0, 1.0, 2.0, 3.0, 0, 0, 0))
    assert to_enu(spot, Origin(-33.0, 151.0, 0.0), HERE) is None
    assert to_enu(spot, HERE, HERE) == (2.0, 1.0, -3.0)


@pytest.mark.parametrize(("frame_id", "up"), [(0, 12.0), (5, 12.0), (3, 500.0), (6, 500.0)])
def test_targets_in_degrees_are_above_the_ground_or_the_sea(frame_id, up):
    frame = OwnFrame()
    here = mav.MAVLink_global_position_int_message(
        0, 473977000, 85456000, 490000, 2000, 0, 0, 0, 65535
    )
    frame.hear_global(here, 1.0)
    m = mav.MAVLink_position_target_global_int_message(
        0, frame_id, 0, 473977000, 85456000, 500.0, *[0] * 8
    )
    assert frame.target_spot(m).up == pytest.approx(up)
