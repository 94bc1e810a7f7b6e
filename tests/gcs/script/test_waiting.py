"""Time-outs count the vehicle's own time."""

from mavherd.gcs.script.waiting import Timer
from mavherd.gcs.station import Station
from mavherd.transport.frames import Origin


def station(*, external):
    return Station("quad1", 1, 20.0, origin=Origin() if external else None)


def test_an_external_vehicle_counts_its_own_seconds():
    vehicle = station(external=True)
    vehicle.status.boot_s = 40.0
    timer = Timer(vehicle, now=100.0)
    vehicle.status.boot_s = 45.0  # a simulator that runs five times as fast
    assert timer.count(now=101.0) == 5.0
    assert timer.count(now=109.0) == 5.0  # nothing heard of it


def test_a_reboot_does_not_set_the_time_back():
    vehicle = station(external=True)
    vehicle.status.boot_s = 40.0
    timer = Timer(vehicle, now=0.0)
    for boot_s, elapsed in ((43.0, 3.0), (1.0, 3.0), (3.0, 5.0)):
        vehicle.status.boot_s = boot_s
        assert timer.count(now=0.0) == elapsed


def test_our_own_vehicles_have_the_fleet_time():
    vehicle = station(external=False)
    timer = Timer(vehicle, now=7.0)
    assert timer.count(now=9.5) == 2.5
