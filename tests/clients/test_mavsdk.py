"""MAVSDK does whole jobs: version 4, and the older one through the server that it ships."""

import socket

import pytest

pytestmark = [pytest.mark.clients, pytest.mark.timeout(500)]


@pytest.fixture(scope="module")
def facts(start, run_once):
    """What MAVSDK 4 has seen in a flight with each kind of autopilot."""
    done = {}

    def fly(autopilot):
        if autopilot not in done:
            done[autopilot] = {}  # a flight that fails is not tried again
            # setpoints come by the wall clock, and may come late
            patient = ("--param", "COM_OF_LOSS_T=60") if autopilot == "px4" else ()
            vehicle = start("quadcopter", "--autopilot", autopilot, *patient, speed=3)
            url = {
                "ardupilot": f"udpout://127.0.0.1:{vehicle.udpin}",
                "px4": f"tcpout://127.0.0.1:{vehicle.tcp}",
            }[autopilot]
            done[autopilot] = run_once("mavsdk_job.py", url, autopilot)
        if not done[autopilot]:
            pytest.skip("the flight has failed")
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
    assert seen["param_got"] == seen["param_set"]
    assert seen["param_refusals"] == {"unknown": "TIMEOUT", "wrong type": "WRONG_TYPE"}


@BOTH
def test_mavsdk_hears_every_stream_but_that_of_a_sensor_that_is_not_there(facts, autopilot):
    seen = facts(autopilot)
    assert seen["silent"] == ["distance_sensor"]
    assert len(seen["heard"]) >= 30
    assert set(seen["rates_refused"]) == {"distance_sensor"}


@BOTH
def test_mavsdk_is_answered_whatever_it_asks(facts, autopilot):
    answers = facts(autopilot)["answers"]
    assert "47.3977" in answers["origin"]
    assert "ListDirectoryData" in answers["files"]
    assert answers["download"] == "1b67"  # the magic number of a parameter pack
    assert answers["upload"] == "FILE_PROTECTED"
    assert answers["logs"] == "NO_LOGFILES"
    assert (
        int(answers["metadata"])
        == facts(autopilot)["int_params"] + (facts(autopilot)["float_params"])
    )
    assert float(answers["return altitude"]) > 0
    assert answers["orbit"] == "UNSUPPORTED"
    assert answers["unknown command"] == "3"  # MAV_RESULT_UNSUPPORTED


@BOTH
def test_mavsdk_flies_by_action_and_offboard(facts, autopilot):
    seen = facts(autopilot)
    assert seen["took_off"]
    assert seen["went_to"]
    assert seen["stick_mode"] == "ALTCTL"
    assert abs(seen["stick_height"] - 5) < 0.5
    for how in ("position", "velocity", "both", "acceleration", "attitude", "stopped"):
        assert seen[f"offboard_{how}"]
    assert seen["landed"]
    assert seen["off_rally_point"] < 2
    assert seen["disarmed"]


@BOTH
def test_mavsdk_uploads_and_flies_a_mission(facts, autopilot):
    seen = facts(autopilot)
    assert seen["finished"]
    current, total = seen["mission_steps"][-1]
    assert current == total == (3 if autopilot == "px4" else 4)
    if autopilot == "px4":
        assert seen["downloaded"] == 3
        assert max(seen["apart"]) < 0.05
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


def test_mavsdk_drives_a_rover(start, run):
    vehicle = start("rover", speed=3)
    seen = run("mavsdk_rover_job.py", f"udpin://127.0.0.1:{vehicle.udpout}")
    assert seen["vehicle"] == "ROVER"
    for what in ("position", "velocity", "backwards", "turned", "mission", "disarmed"):
        assert seen[what]


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
    assert seen["steps"][-1] == 3
    assert seen["landed"]
