"""DroneKit 2.9.2 flies a copter and drives a rover, by TCP and by UDP."""

import pytest

pytestmark = [pytest.mark.clients, pytest.mark.timeout(500)]


@pytest.mark.parametrize(("kind", "how"), [("quadcopter", "tcp"), ("rover", "udp")])
def test_dronekit_does_a_whole_job(start, run, kind, how):
    vehicle = start(kind, speed=4)
    address = {"tcp": f"tcp:127.0.0.1:{vehicle.tcp}", "udp": f"127.0.0.1:{vehicle.udpout}"}[how]
    seen = run("dronekit_job.py", address, kind)
    assert seen["version"].startswith("APM:Copter-4.6" if kind == "quadcopter" else "APM:Rover-4.6")
    assert seen["gps"][0] >= 3
    assert seen["ekf_ok"]
    assert seen["state"] == ("STANDBY" if kind == "quadcopter" else "ACTIVE")
    assert seen["empty_mission"] == 0
    assert seen["parameters"] >= 100
    assert seen["set_parameter"][0] != seen["set_parameter"][1]
    assert seen["parameter_listener"]
    assert seen["armed"]
    assert seen["went"]
    commands = [16, 16] if kind == "rover" else [22, 16, 16]
    assert [row[0] for row in seen["downloaded"]] == commands
    assert seen["uploaded"] == len(commands)
    assert seen["mission"]
    assert seen["landed"]
    assert all(seen["heard"].get(name, 0) > 3 for name in ("attitude", "velocity", "battery"))
