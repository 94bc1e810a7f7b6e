"""pymavlink's own tool gets files from the vehicle, and puts none there."""

import pytest


@pytest.mark.clients
@pytest.mark.timeout(500)
def test_pymavlinks_tool_transfers_files(start, run):
    vehicle = start("quadcopter", speed=3)
    seen = run("mavftp_job.py", f"tcp:127.0.0.1:{vehicle.tcp}")
    assert seen["list"] == seen["get"] == seen["crc"] == seen["getparams"] == 0
    assert "@PARAM/" in seen["directories"]
    assert seen["size"] > 1000
    assert seen["same"]
    assert seen["parameters"] >= 150
    assert set(seen["refused"].values()) == {1}
