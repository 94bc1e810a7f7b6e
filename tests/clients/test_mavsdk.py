"""MAVSDK does whole jobs: version 4, and the older one through the server that it ships."""

import socket

import pytest

pytestmark = [pytest.mark.clients, pytest.mark.timeout(200)]

NO_SUCH_SENSOR = {
    "actuator_control_target",  # a message that no flight stack sends any more
    "distance_sensor",
    "ground_truth",  # a HIL simulator's
}
"""Streams that MAVSDK offers for what our vehicles do not have."""


@pytest.fixture(scope="module")
def facts(start, run_once):
    """What MAVSDK 4 has seen in a flight with each kind of autopilot."""
    done = {}

    def fly(autopilot):
        if autopilot not in done:
            vehicle = start("quadcopter", "--autopilot", autopilot, speed=3)
            url = {
                "ardupilot": f"udpout://127.0.0.1:{vehicle.udpin}",
                "px4": f"tcpout://127.0.0.1:{vehicle.tcp}",
            }[autopilot]
            done[autopilot] = run_once("mavsdk_job.py", url, autopilot)
        return done[autopilot]

    return fly


BOTH = pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])


@BOTH
def test_mavsdk_knows_and_trusts_the_vehicle(facts, autopilot):
    seen = facts(autopilot)
    assert seen["autopilot"] == {"ardupilot": "ARDUPILOT", "px4": "PX4"}[autopilot]
    assert seen["components"] == [1]
    assert seen["healthy"]
    assert seen["armable"]
    assert seen["version"][0] == (4 if autopilot == "ardupilot" else 1)


@BOTH
def test_mavsdk_reads_and_sets_parameters(facts, autopilot):
    seen = facts(autopilot)
    assert seen["int_params"] >= 10
    assert seen["float_params"] >= 10
    assert seen["params"] in (
        {"RTL_ALT": 1200, "FENCE_RADIUS": 123.5},
        {"COM_DL_LOSS_T": 20, "MPC_XY_CRUISE": 7.5},
    )
    assert set(seen["param_refusals"]) == {"unknown", "wrong type"}


@BOTH
def test_mavsdk_hears_every_stream_that_there_is_a_sensor_for(facts, autopilot):
    seen = facts(autopilot)
    assert set(seen["silent"]) <= NO_SUCH_SENSOR
    assert {"position", "odometry", "battery", "imu", "wind", "altitude"} <= set(seen["heard"])


@BOTH
def test_mavsdk_flies_by_action_and_offboard(facts, autopilot):
    seen = facts(autopilot)
    assert seen["took_off"]
    assert seen["went_to"]
    for how in ("position", "velocity", "both", "acceleration", "attitude", "stopped"):
        assert seen[f"offboard_{how}"]
    assert seen["landed"]
    assert seen["off_home"] < 1
    assert seen["disarmed"]


@BOTH
def test_mavsdk_uploads_and_flies_a_mission(facts, autopilot):
    seen = facts(autopilot)
    assert seen["finished"]
    current, total = seen["mission_steps"][-1]
    assert current == total == (3 if autopilot == "px4" else 4)
    if autopilot == "px4":
        assert seen["downloaded"] == 3
        assert max(seen["places"]) < 0.05
    else:  # the same on a real ArduCopter: MAVSDK wants frame 6 in every item
        assert seen["download"] == "UNSUPPORTED"


@BOTH
def test_mavsdk_passes_raw_missions_fences_and_rally_points(facts, autopilot):
    seen = facts(autopilot)
    first = 1 if autopilot == "ardupilot" else 0  # item 0 is home there
    assert seen["raw_got"][first:] == seen["raw_sent"][first:]
    assert seen["fence_got"] == seen["fence_sent"]
    assert seen["rally_got"] == seen["rally_sent"]
    assert seen["fence_points"] == 4
    assert seen["fence_radius"] == 150


def test_the_older_mavsdk_flies_in_short(start, run, free_port):
    vehicle = start("quadcopter", speed=3)
    address = f"tcpout://127.0.0.1:{vehicle.tcp}"
    seen = run("mavsdk_grpc_job.py", address, free_port(socket.SOCK_STREAM))
    assert seen["armable"]
    assert (seen["rtl_alt"], seen["fence_radius"]) == (1300, 222.5)
    assert seen["unknown_param"]
    assert seen["got"][1:] == seen["sent"][1:]
    assert seen["unknown_item"] == "UNSUPPORTED"
    assert seen["went"]
    assert seen["velocity"]
    assert seen["position"]
    assert {1, 2, 3} <= set(seen["steps"])
    assert seen["landed"]
