"""Outside vehicles become a recording: they turn up, move, reboot, fall silent and come back."""

import numpy as np
import pytest

pytest.importorskip("rerun")

import rerun as rr

from mavherd.gcs.recording.outside.watch import Outside
from mavherd.gcs.recording.stream import Stream
from mavherd.transport.frames import Origin
from mavherd.transport.mavlink import Codec, mav

THERE = Origin(47.39860, 8.54760, 490.0)


def sent_by(system, *messages, component=1):
    """Return messages as they are heard from a system."""
    return Codec(0).decode(Codec(system, component).encode(messages))


def heartbeat(mav_type, autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA, mode=0, armed=False):
    return mav.MAVLink_heartbeat_message(mav_type, autopilot, 128 * armed, mode, 4, 3)


@pytest.fixture(scope="module", autouse=True)
def strict():
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture(scope="module")
def flight(desk, heard, read, tmp_path_factory):
    """A copter that flies, a rover with an origin of its own that comes late, heard for 24 s."""
    path = tmp_path_factory.mktemp("outside") / "flight.rrd"
    outside = Outside(Stream("flight", file=path), "two")
    copter = desk("quadcopter", autopilot="px4")
    rover = desk("rover", system_id=7, origin=THERE, north=3.0, east=4.0)
    at = 0.0
    for now, m in heard(4.0, copter):
        outside.hear(m, "udp:copter", now)
        if now > at:
            outside.flush(now)
            at = now + 0.5
    copter.command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 491.0)
    copter.arm()
    for now, m in heard(20.0, copter, rover):
        later = max(now, copter.now)
        outside.hear(
            m, f"udp:{m.get_srcSystem()}" if m.get_srcSystem() == 7 else "udp:copter", later
        )
        if later > at:
            outside.flush(later)
            at = later + 0.5
    outside.close(copter.now)
    return read(path), copter, rover


def test_a_copter_is_where_it_flies(flight):
    recording, copter, _ = flight
    time, place = recording.positions("sys1")
    assert time[-1] > 23
    assert place[0] == pytest.approx([0, 0, 0], abs=0.02)
    k = copter.where
    assert place[-1] == pytest.approx([k.east, k.north, -k.down], abs=0.1)
    assert place[-1][2] > 2
    assert np.diff(time).max() < 0.1


def test_one_that_comes_late_stands_where_its_own_origin_puts_it(flight):
    recording, copter, _ = flight
    time, place = recording.positions("sys7")
    assert time[0] > 3.9
    here = copter.vehicle.config.origin
    north, east = here.from_geodetic(*THERE.to_geodetic(3.0, 4.0))
    assert place[-1] == pytest.approx([east, north, 0], abs=0.05)


def test_modes_have_the_names_of_their_flight_stack(flight):
    recording, _, _ = flight
    modes = recording.modes("sys1")
    assert modes[0].endswith("disarmed")
    assert any("TAKEOFF" in mode for mode in modes)
    assert recording.modes("sys7") == ["MANUAL disarmed"]


def test_events_tell_who_came_and_what_they_said(flight):
    texts = flight[0].texts()
    assert any("quadrotor, px4, system 1, heard at udp:copter" in text for text in texts)
    assert any("ground rover, ardupilot, system 7" in text for text in texts)
    assert any("sys1" in text and "Armed" in text.title() for text in texts)


def test_batteries_and_links_are_plotted(flight):
    recording, _, _ = flight
    _, volts = recording.numbers("/telemetry/battery/sys1")
    assert 9 < volts.min() <= volts.max() < 17
    _, rates = recording.numbers("/telemetry/rates/sys1")
    assert rates.max() > 20
    _, ages = recording.numbers("/telemetry/ages/sys1")
    assert ages.max() < 2


def record(tmp_path, read, *heard, until):
    """Record messages given as (time, source, messages); return the recording and the events."""
    path, told = tmp_path / "some.rrd", []
    outside = Outside(Stream("some", file=path), "some", told.append)
    flows = sorted(heard, key=lambda item: item[0])
    for step in range(round(until * 2)):
        now = step / 2
        while flows and flows[0][0] <= now:
            at, source, messages = flows.pop(0)
            for message in messages:
                outside.hear(message, source, at)
        outside.flush(now)
    outside.close(until)
    return read(path), [event["text"] for event in told]


def local(boot_ms, x, y, z):
    return mav.MAVLink_local_position_ned_message(boot_ms, x, y, z, 0, 0, 0)


def test_a_reboot_is_told_and_the_recording_goes_on(tmp_path, read):
    beats = [
        (t, "a", sent_by(3, heartbeat(2), local(900_000 + 1000 * t, t, 0, 0))) for t in range(10)
    ]
    again = [(t, "a", sent_by(3, heartbeat(2), local(1000 * t, t, 0, 0))) for t in range(12, 20)]
    recording, told = record(tmp_path, read, *beats, *again, until=21)
    time, place = recording.positions("sys3")
    assert np.all(np.diff(time) > 0)
    assert place[-1][1] == pytest.approx(19, abs=0.1)
    assert any("rebooted" in text for text in told)


def test_silence_and_return_are_told(tmp_path, read):
    times = [*range(5), *range(12, 15)]
    flow = [(t, "a", sent_by(3, heartbeat(2), local(1000 + 1000 * t, 0, 0, 0))) for t in times]
    recording, told = record(tmp_path, read, *flow, until=16)
    assert "link silent" in told
    assert any(text.startswith("link back after 8") for text in told)
    _, ages = recording.numbers("/telemetry/ages/sys3")
    assert ages.max() > 7
    time, _ = recording.positions("sys3")
    assert not ((time > 4.1) & (time < 11.9)).any()  # nobody knows where it was


@pytest.mark.parametrize(
    ("mav_type", "mode", "shown"),
    [(1, 11, "RTL"), (12, 9, "SURFACE"), (11, 4, "HOLD"), (20, 17, "QSTABILIZE"), (7, 3, "AUTO")],
)
def test_vehicles_of_other_kinds_are_shown_too(tmp_path, read, mav_type, mode, shown):
    flow = [
        (t, "a", sent_by(9, heartbeat(mav_type, mode=mode), local(1000 + 1000 * t, t, 0, -5)))
        for t in range(9)
    ]
    recording, _ = record(tmp_path, read, *flow, until=10)
    assert recording.positions("sys9")[1][-1] == pytest.approx([0, 8, 5], abs=0.1)
    assert recording.modes("sys9") == [f"{shown} disarmed"]


def test_ground_stations_gimbals_and_radios_are_no_vehicles(tmp_path, read):
    nobody = mav.MAV_AUTOPILOT_INVALID
    flow = [
        (1, "a", sent_by(255, heartbeat(mav.MAV_TYPE_GCS, nobody), component=190)),
        (1, "a", sent_by(1, heartbeat(mav.MAV_TYPE_GIMBAL, nobody), component=154)),
        (1, "a", sent_by(51, heartbeat(mav.MAV_TYPE_ONBOARD_CONTROLLER, nobody))),
        (1, "a", sent_by(8, local(1, 0, 0, 0))),
    ]
    recording, told = record(tmp_path, read, *flow, until=2)
    assert told == []
    assert not [e for e in recording.entities if "sys" in e]


def test_two_vehicles_of_one_id_are_told_and_not_mixed(tmp_path, read):
    flow = []
    for t in range(8):
        flow.append((t, "a", sent_by(1, heartbeat(2), local(1000 + 1000 * t, 0, 0, 0))))
        flow.append((t + 0.2, "b", sent_by(1, heartbeat(2), local(900 + 1000 * t, 50, 50, 0))))
    recording, told = record(tmp_path, read, *flow, until=9)
    assert np.abs(recording.positions("sys1")[1]).max() < 0.1
    assert len([text for text in told if "only the first is shown" in text]) == 1


def test_without_any_position_attitude_is_shown_all_the_same(tmp_path, read):
    def attitude(t):
        return mav.MAVLink_attitude_message(250 * t + 1, 0.3, 0, 0, 0, 0, 0)

    flow = [(t / 4, "a", sent_by(1, heartbeat(2), attitude(t))) for t in range(40)]
    recording, told = record(tmp_path, read, *flow, until=11)
    assert any("no position" in text for text in told)
    turned = recording.rows("/world/robots/sys1/body", "Transform3D:quaternion")
    assert len(turned) > 50


def attitudes(at, boot_ms, roll=0.3):
    servos = mav.MAVLink_servo_output_raw_message(1000 * boot_ms, 0, *[1500] * 8)
    return at, "a", sent_by(1, mav.MAVLink_attitude_message(boot_ms, roll, *[0] * 5), servos)


def test_without_a_position_any_more_it_turns_where_it_was(tmp_path, read):
    moving = [
        (t / 4, "a", sent_by(1, heartbeat(2), local(250 * t + 1, t / 4, 0, -2))) for t in range(21)
    ]
    turning = [attitudes(t / 4, 250 * t + 2, roll=t / 100) for t in range(80)]
    recording, _ = record(tmp_path, read, *moving, *turning, until=21)
    rows = recording.rows("/world/robots/sys1/body", "Transform3D:quaternion")
    late = [(t, quaternion[0][0]) for t, quaternion in rows if 10 < t < 19]
    assert len(late) > 100
    assert late[-1][1] - late[0][1] == pytest.approx(0.122, abs=0.005)
    time, place = recording.positions("sys1")
    assert place[time > 10] == pytest.approx(np.tile([0, 5, 2], (sum(time > 10), 1)), abs=0.05)


@pytest.mark.parametrize("tells", ["positions", "attitudes", "servos"])
def test_of_what_goes_on_alone_no_more_is_kept_than_is_needed(tmp_path, tells):
    outside = Outside(Stream("long", file=tmp_path / "long.rrd"), "long")
    for m in sent_by(1, heartbeat(2), local(1, 0, 0, 0)):
        outside.hear(m, "a", 0.0)
    vehicle = outside.vehicles[1]
    kept = []
    for step in range(1, 200):
        _, _, messages = attitudes(0, 250 * step)
        if tells == "positions":
            messages = sent_by(1, local(250 * step, 1, 0, 0))
        for m in messages:
            if tells != "servos" or m.get_type() == "SERVO_OUTPUT_RAW":
                outside.hear(m, "a", step / 4)
        outside.flush(step / 4)
        series = vehicle.velocities, vehicle.attitudes, vehicle.rates, vehicle.servos
        kept.append(max(map(len, series)))
    outside.close(50.0)
    assert max(kept) < 40
    assert vehicle.heard > 180


@pytest.fixture
def plots(tmp_path, read, monkeypatch):
    """Record what is heard; return the titles of the plots that are laid out at the end."""
    laid_out = []
    monkeypatch.setattr(Stream, "blueprint", lambda _, layout: laid_out.append(layout))

    def titles(part):
        own = [part.name] if type(part).__name__ == "TimeSeriesView" else []
        return own + [
            t for p in getattr(part, "contents", ()) if hasattr(p, "name") for t in titles(p)
        ]

    def run(*flow):
        record(tmp_path, read, *flow, until=12)
        return [title.partition(",")[0] for title in titles(laid_out[-1].root_container)]

    return run


def test_at_the_end_there_is_a_plot_of_nothing_that_nobody_told(plots):
    turning = [attitudes(t / 4, 250 * t + 2) for t in range(40)]
    alone = plots((0, "a", sent_by(1, heartbeat(2))), *turning)
    assert alone == ["Silent for", "Messages", "Attitude", "Heading", "Servo outputs 1 to 4"]


def test_two_that_tell_where_they_are_have_a_separation(plots):
    flow = [
        (t, f"{i}", sent_by(i, heartbeat(2), local(1000 * t + 1, i, 0, -1)))
        for t in range(10)
        for i in (1, 2)
    ]
    titles = plots(*flow)
    assert titles[:3] == ["Speed", "Height", "Smallest separation"]
    assert titles[-2:] == ["Speed", "Height"]
    assert "Off target" not in titles
    assert "Battery" not in titles


def test_long_texts_are_joined(tmp_path, read):
    chunks = ["x" * 50, "y" * 50, "end"]
    texts = [
        mav.MAVLink_statustext_message(3, text.encode(), id=5, chunk_seq=n)
        for n, text in enumerate(chunks)
    ]
    _, told = record(tmp_path, read, (1, "a", sent_by(1, heartbeat(2), *texts)), until=2)
    assert "x" * 50 + "y" * 50 + "end" in told


def test_nan_and_infinity_break_nothing(tmp_path, read):
    nan = float("nan")
    strange = (
        local(2000, nan, 0, 0),
        mav.MAVLink_attitude_message(2000, nan, 0, 0, 0, 0, 0),
        mav.MAVLink_position_target_local_ned_message(2000, 1, 0, *[nan] * 11),
        mav.MAVLink_global_position_int_message(2000, 2**31 - 1, 5, 0, 0, 0, 0, 0, 0),
        mav.MAVLink_gps_global_origin_message(2**31 - 1, 5, 0),
    )
    good = [(t, "a", sent_by(1, heartbeat(2), local(1000 * t + 1, 1, 2, -3))) for t in range(9)]
    recording, _ = record(tmp_path, read, *good, (3, "a", sent_by(1, *strange)), until=10)
    assert np.isfinite(recording.positions("sys1")[1]).all()
