"""What the options, files and variables of `mavherd vehicle` do, and what is said of wrong ones."""

import json
import re
import shutil
import signal
import socket
from contextlib import closing

import pytest

PLAN = {
    "fileType": "Plan",
    "version": 1,
    "mission": {
        "version": 2,
        "firmwareType": 3,
        "vehicleType": 2,
        "plannedHomePosition": [47.3977, 8.5456, 488],
        "items": [
            {"type": "SimpleItem", "command": command, "frame": 3, "autoContinue": True,
             "params": [0, 0, 0, None, 47.3978, 8.5457, 10]}
            for command in (22, 16, 16)
        ],
    },
    "geoFence": {
        "version": 2,
        "circles": [{"version": 1, "inclusion": True,
                     "circle": {"center": [47.3977, 8.5456], "radius": 200}}],
        "polygons": [],
    },
    "rallyPoints": {"version": 2, "points": [[47.3977, 8.5456, 20], [47.3978, 8.5456, 20]]},
}  # fmt: skip
WAYPOINTS = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t47.3977\t8.5456\t488\t1
1\t0\t3\t22\t0\t0\t0\t0\t47.3977\t8.5456\t10\t1
2\t0\t3\t16\t0\t0\t0\t0\t47.3978\t8.5457\t10\t1
"""


class Client:
    """A stock client on one vehicle's UDP port; the vehicle ends with it, and leaves nothing."""

    def __init__(self, sandbox, kind, *options, environ=()):
        self._sandbox = sandbox
        prefix = ("env", *environ) if environ else ()
        words = "vehicle", kind, "--udpin", "127.0.0.1:0", *options
        self.process = sandbox.start(*words, prefix=prefix)
        self.line = self.process.stdout.readline()
        self.port = int(re.search(r"udpin:127.0.0.1:(\d+)", self.line)[1])
        self.link = sandbox.connect(f"udpout:127.0.0.1:{self.port}")
        sandbox.greet(self.link)

    def wait(self, name, condition="True", timeout=60):
        m = self.link.recv_match(type=name, blocking=True, timeout=timeout, condition=condition)
        assert m is not None, f"no {name} where {condition}"
        return m

    def parameter(self, name):
        self.link.mav.param_request_read_send(1, 1, name.encode(), -1)
        return self.wait("PARAM_VALUE", f"PARAM_VALUE.param_id=={name!r}").param_value

    def set(self, name, value):
        self.link.mav.param_set_send(1, 1, name.encode(), value, 9)
        self.wait("PARAM_VALUE", f"PARAM_VALUE.param_id=={name!r}")

    def count(self, mission_type):
        self.link.mav.mission_request_list_send(1, 1, mission_type)
        return self.wait("MISSION_COUNT").count

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.link.close()
        self.process.send_signal(signal.SIGINT)
        self.done = self._sandbox.finish(self.process)
        assert self.done.code == 0


@pytest.fixture
def client(sandbox):
    return lambda kind, *options, **more: Client(sandbox, kind, *options, **more)


def one_line(done):
    (line,) = done.err.splitlines()
    assert line.startswith("mavherd: ")
    assert (done.code, done.out) == (2, "")
    return line


def test_a_plan_brings_its_fence_and_rally_points(sandbox, client):
    (sandbox.folder / "field.plan").write_text(json.dumps(PLAN))
    with client("quadcopter", "--mission", "field.plan") as c:
        assert [c.count(kind) for kind in (0, 1, 2)] == [4, 1, 2]  # home is item 0


def test_a_waypoint_file_is_taken_by_the_vehicle_of_a_px4_too(sandbox, client):
    (sandbox.folder / "field.waypoints").write_text(WAYPOINTS)
    with client("quadcopter", "--mission", "field.waypoints", "--autopilot", "px4") as c:
        assert c.count(0) == 2  # home is no item


def test_parameters_come_from_files_then_from_options(sandbox, client):
    (sandbox.folder / "first.param").write_text("RTL_ALT,1800\nWPNAV_SPEED,300\nEK3_ENABLE,1\n")
    (sandbox.folder / "second.parm").write_text("# mine\nRTL_ALT 1900\nFENCE_RADIUS 55\n")
    files = "--params", "first.param", "--defaults", "second.parm"
    with client("quadcopter", *files, "--param", "FENCE_RADIUS=66") as c:
        values = {n: c.parameter(n) for n in ("RTL_ALT", "WPNAV_SPEED", "FENCE_RADIUS")}
    assert values == {"RTL_ALT": 1900, "WPNAV_SPEED": 300, "FENCE_RADIUS": 66}
    assert "first.param: 1 parameters that this vehicle does not have" in c.done.err
    assert "EK3_ENABLE" in c.done.err


def test_a_folder_keeps_what_clients_set_until_it_is_wiped(sandbox, client):
    folder = sandbox.folder / "deep" / "kept"
    for options, before, after in (
        ((), 1500, 1700),
        ((), 1700, 1800),
        (("--param", "RTL_ALT=1600"), 1600, 1900),
        (("--wipe",), 1500, 1500),
        ((), 1500, 1500),
    ):
        with client("quadcopter", "--folder", folder, *options) as c:
            assert c.parameter("RTL_ALT") == before
            if after != before:
                c.set("RTL_ALT", after)
    assert [path.name for path in folder.iterdir()] == ["parameters.param"]


def test_what_cannot_be_kept_any_more_is_set_and_complained_of(sandbox, client):
    with client("quadcopter", "--folder", "kept") as c:
        shutil.rmtree(sandbox.folder / "kept")
        c.link.mav.param_set_send(1, 1, b"RTL_ALT", 1700, 9)
        c.wait("STATUSTEXT", "'cannot be written' in STATUSTEXT.text")
        assert c.parameter("RTL_ALT") == 1700


def test_a_broken_file_of_a_folder_is_not_lost_but_by_a_wipe(sandbox, client):
    kept = sandbox.folder / "kept" / "parameters.param"
    kept.parent.mkdir()
    kept.write_text("RTL_ALT,high\n")
    done = sandbox.run("vehicle", "quadcopter", "--folder", "kept", "--udpin", "127.0.0.1:0")
    assert "kept/parameters.param:1: RTL_ALT is 'high'" in one_line(done)
    assert "--wipe" in done.err
    assert kept.read_text() == "RTL_ALT,high\n"
    with client("quadcopter", "--folder", "kept", "--wipe") as c:
        assert c.parameter("RTL_ALT") == 1500


def test_home_is_an_option_or_what_px4_calls_it(client):
    px4 = "PX4_HOME_LAT=-35.3", "PX4_HOME_LON=149.2", "PX4_HOME_ALT=584"
    for options, environ, alt_mm, heading_cdeg in (
        (("--home", "-35.3,149.2,100,90", "--position", "0,0,0"), px4, 100_000, 9000),
        ((), px4, 584_000, 0),
    ):
        with client("rover", *options, environ=environ) as c:
            m = c.wait("GLOBAL_POSITION_INT")
            assert (m.lat, m.lon) == (-353_000_000, 1_492_000_000)
            assert (m.alt, m.relative_alt, m.hdg) == (alt_mm, 0, heading_cdeg)


@pytest.mark.parametrize(
    ("options", "environ"),
    [
        (("--speedup", "20"), ()),
        ((), ("PX4_SIM_SPEED_FACTOR=20",)),
        (("-s", "20"), ("PX4_SIM_SPEED_FACTOR=0.1",)),
    ],
)
def test_time_passes_as_fast_as_was_asked_for(sandbox, client, options, environ):
    with client("rover", *options, environ=environ) as c:
        first = c.wait("SYSTEM_TIME").time_boot_ms
        # 60 s of vehicle time: 3 s here, more on a busy machine, 60 s at normal speed
        c.wait("SYSTEM_TIME", f"SYSTEM_TIME.time_boot_ms > {first + 60_000}", timeout=50)


@pytest.mark.parametrize(("stack", "number"), [("ardupilot", 3), ("px4", 12), ("generic", 0)])
def test_it_is_taken_for_what_was_asked_for(client, stack, number):
    with client("rover", "--autopilot", stack, "--sysid", 7, "--name", "scout") as c:
        heartbeat = c.wait("HEARTBEAT")
        assert (heartbeat.autopilot, heartbeat.get_srcSystem()) == (number, 7)
    assert c.line.startswith("scout: rover, system id 7: ")


def test_a_profile_has_gains_of_its_own(client):
    speeds = {}
    for profile in ("default", "ardupilot"):
        with client("quadcopter", "--profile", profile) as c:
            speeds[profile] = c.parameter("WPNAV_SPEED")
    assert speeds["ardupilot"] != speeds["default"]


def test_several_clients_share_a_listening_port(sandbox, client):
    with client("rover") as c, closing(sandbox.connect(f"udpout:127.0.0.1:{c.port}")) as other:
        sandbox.greet(other)
        for link in (c.link, other, c.link, other):
            assert link.recv_match(type="ATTITUDE", blocking=True, timeout=60)


@pytest.mark.parametrize("count", [1, 3])
def test_a_port_that_is_taken_is_told_and_none_is_left(sandbox, count):
    with (
        socket.socket(type=socket.SOCK_DGRAM) as udp,
        socket.create_server(("127.0.0.1", 0)) as tcp,
    ):
        udp.bind(("127.0.0.1", 0))
        for taken, option in ((udp, "--udpin=127.0.0.1:{}"), (tcp, "--tcp={}")):
            port = taken.getsockname()[1]
            done = sandbox.run("vehicle", "rover", "--count", count, option.format(port))
            assert f":{port}: Address already in use (choose another port" in one_line(done)


def test_help_fits_a_narrow_terminal(sandbox):
    done = sandbox.run("vehicle", "--help", prefix=("env", "COLUMNS=80"))
    assert done.code == 0
    assert max(map(len, done.out.splitlines())) <= 80
    for option in ("--count", "--home", "--params", "--mission", "--folder", "PX4_HOME_LAT"):
        assert option in done.out
