"""Stock tools read our telemetry logs, also those that a killed run leaves."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from mavherd.gcs.flown.flown import open_flown
from mavherd.transport.tlog import read_tlog, torn_at

os.environ["MAVLINK20"] = "1"
from pymavlink import mavutil

TOOLS = Path(sys.executable).parent


@pytest.fixture(params=["whole", "torn"])
def log(request, run_folder, spoil):
    """A log that is whole, and one whose last message is cut short."""
    folder = run_folder if request.param == "whole" else spoil(run_folder)
    path = open_flown(folder).tlog("rover1")
    assert (torn_at(path) is None) == (request.param == "whole")
    return path


def test_mavutil_reads_every_message(log):
    reader = mavutil.mavlink_connection(str(log))
    read = [message._timestamp for message in iter(reader.recv_msg, None)]
    reader.close()
    ours = [time_us * 1e-6 for time_us, _ in read_tlog(log)]
    assert read == pytest.approx(ours, abs=1e-6)


def test_the_tools_of_pymavlink_read_it(log):
    commands = {
        "dump": ["mavlogdump.py", "--format", "json", "--types", "LOCAL_POSITION_NED", log],
        "loss": ["mavloss.py", log],
        "modes": ["mavflightmodes.py", log],
    }
    running = {
        name: subprocess.Popen(
            [sys.executable, TOOLS / tool, *rest],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            text=True,
        )
        for name, (tool, *rest) in commands.items()
    }
    said = {name: process.communicate(timeout=60)[0] for name, process in running.items()}
    assert [process.returncode for process in running.values()] == [0, 0, 0]
    dumped = [json.loads(line)["data"] for line in said["dump"].splitlines()]
    assert dumped[-1]["y"] == pytest.approx(0.6, abs=0.25)  # east, where it was to go
    assert re.search(r"Total: \d+ packets, 0 lost", said["loss"])
    assert re.search(r"^GUIDED ", said["modes"], re.MULTILINE)
