"""MAVProxy at its prompt: what a person types works, and the answers are read."""

import pytest

pytestmark = [pytest.mark.clients, pytest.mark.timeout(500)]


def test_a_person_at_mavproxys_prompt_flies_a_copter(start, run):
    vehicle = start("quadcopter", speed=3)
    seen = run("mavproxy_job.py", f"tcp:127.0.0.1:{vehicle.tcp}", "quadcopter")
    assert seen["parameters"] >= 150
    assert seen["rtl_alt"] == [1500, 1200, 1200]
    assert seen["listed"] == {"wp": 5, "fence": 4, "rally": 2}
    assert seen["heights"] == [488, 5, 5, 6, 0]
    assert seen["rally_after_clear"] == 0
    for what in ("took_off", "guided", "mission", "returned"):
        assert seen[what]
    assert seen["refused"]


def test_a_person_at_mavproxys_prompt_drives_a_rover(start, run):
    vehicle = start("rover", speed=3)
    seen = run("mavproxy_job.py", f"udpin:127.0.0.1:{vehicle.udpout}", "rover")
    assert seen["parameters"] >= 150
    for what in ("guided", "returned", "disarmed"):
        assert seen[what]
