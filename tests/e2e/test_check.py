"""`mavherd check` finds real vehicles ready, or says what is missing and how to mend it."""

import json
import re
import signal
import socket
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import pytest

from mavherd.gcs.commands.live_check import inspect
from mavherd.scenarios.loader import load_scenario

UDP_PORTS = Path("/proc/net/udp")
TEAM = """
name: field
team: {{start_sigma_m: 0}}
robots:
  - {{name: quad1, kind: quadcopter, start: {{east: 0, north: 0}}, system_id: 1,
     connect: "{quad}", goto: {{east: 3, north: 3, up: 2}}}}
  - {{name: rover1, kind: rover, start: {{east: 6, north: -2, heading_deg: 90}}, system_id: 2,
     connect: "{rover}"}}
  - {{name: ours, kind: rover, start: {{east: -6, north: 0}}}}
"""


@pytest.fixture
def field(sandbox):
    """Two places for vehicles, a scenario that wants them, and the means to start and check."""
    return Field(sandbox)


class Field:
    def __init__(self, sandbox):
        self.sandbox = sandbox
        self.tcp = sandbox.free_port()
        self.udp = sandbox.free_port(socket.SOCK_DGRAM)
        quad, rover = f"tcp:127.0.0.1:{self.tcp}", f"udpin:127.0.0.1:{self.udp}"
        (sandbox.folder / "field.yaml").write_text(TEAM.format(quad=quad, rover=rover))

    def quad(self, *options):
        return self._vehicle("quadcopter", "--sysid", 1, "--tcp", self.tcp, *options)

    def rover(self, *options, kind="rover"):
        address = f"127.0.0.1:{self.udp}"
        return self._vehicle(kind, "--sysid", 2, "--udpout", address, *options)

    def _vehicle(self, *words):
        vehicle = self.sandbox.start("vehicle", *words)
        assert "system id" in vehicle.stdout.readline()
        return vehicle

    def start_check(self, *options):
        return self.sandbox.start("check", "field.yaml", *options)

    def check(self, *options):
        """Run a check to its end: exit code, stdout, stderr."""
        process = self.start_check(*options)
        out, err = process.communicate(timeout=60)
        assert "Traceback" not in err
        return process.returncode, out, err

    def wait_until_it_listens(self):
        """Wait until a check that has been started has opened its port."""
        bound = f"0100007F:{self.udp:04X} 00000000:0000"
        self.sandbox.wait_for(lambda: bound in UDP_PORTS.read_text(), "the check listens")


def verdicts(out):
    """Return (vehicle, check) -> word of a plain report."""
    found, vehicle = {}, ""
    for line in out.splitlines():
        if heading := re.match(r"(\w+): \w+ at ", line):
            vehicle = heading[1]
        elif row := re.match(r"  (\S+) +([a-z]+) +\S", line):
            found[vehicle, row[2]] = row[1]
    return found


def test_a_ready_team_of_both_flight_stacks(field):
    field.quad("--param", "FENCE_ENABLE=1", "--param", "FENCE_RADIUS=50")
    field.rover("--autopilot", "px4", "--position", "6,-2,0")
    code, out, err = field.check()
    assert (code, err) == (0, "")
    assert out.splitlines()[-1] == "field: 3 robots, law safe, 2 external: ready"
    words = verdicts(out)
    assert len(words) == 16
    assert {word for (_, name), word in words.items() if name != "fence"} == {"ok"}
    assert (words["quad1", "fence"], words["rover1", "fence"]) == ("ok", "note")
    assert re.search(r"identity +ardupilot [\d.]+ quadcopter, system 1", out)
    assert re.search(r"identity +px4 [\d.]+ rover, system 2", out)


def test_what_is_missing_is_named_with_a_cure_that_works(field):
    elsewhere = field.rover("--home", "47.398,8.546,488,0")
    code, out, err = field.check("--wait", 4)
    assert code == 3
    assert err == "mavherd: field: missing: quad1 (link); rover1 (place)\n"
    words = verdicts(out)
    assert words["rover1", "place"] == words["quad1", "link"] == "missing"
    assert words["rover1", "position"] == words["rover1", "ready"] == "ok"
    assert "connection refused" in out.lower()
    home = re.search(r"--home=(\S+)", out)
    elsewhere.send_signal(signal.SIGINT)
    elsewhere.wait(timeout=60)
    field.quad()
    field.rover("--home", home[1])
    code, out, err = field.check()
    assert (code, err) == (0, "")
    assert re.search(r"place +0\.\d m from its start", out)


def test_one_that_would_not_arm_says_why_without_being_waited_for(field):
    field.rover("--position", "6,-2,0")
    field.quad("--param", "BATT_ARM_VOLT=120")
    code, out, err = field.check("--wait", 4)
    assert code == 3
    assert err == "mavherd: field: missing: quad1 (ready)\n"
    assert re.search(r"missing ready +says 'PreArm: .*[Bb]att.*'", out)


def test_a_vehicle_that_comes_late_is_waited_for(field):
    field.rover("--position", "6,-2,0")
    checking = field.start_check("--wait", 40, "--json")
    field.wait_until_it_listens()
    field.quad()
    out, err = checking.communicate(timeout=60)
    assert (checking.returncode, err) == (0, "")
    found = json.loads(out)
    assert found["ready"]
    assert [v["ready"] for v in found["vehicles"].values()] == [True, True]
    assert found["vehicles"]["rover1"]["checks"][0].keys() == {
        *("name", "ok", "text", "cure", "required")
    }


def test_strangers_and_wrong_kinds_are_found_out(field):
    field.quad("--sysid", 7)
    field.rover(kind="quadcopter")
    code, out, err = field.check()  # which nobody waits out: it is hopeless
    assert code == 3
    assert err == "mavherd: field: missing: quad1 (link); rover1 (identity)\n"
    assert "system 7 answers here, the scenario wants 1" in out
    assert "it is a quadrotor, not a rover" in out


def test_a_port_that_another_program_has_is_wrong_input(field):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", field.udp))
        code, out, err = field.check()
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert f"127.0.0.1:{field.udp}" in err


def test_an_interrupted_check_ends_at_once(field):
    field.rover("--position", "6,-2,0")
    checking = field.start_check("--wait", 600)
    field.wait_until_it_listens()
    checking.send_signal(signal.SIGINT)
    _, err = checking.communicate(timeout=60)
    assert (checking.returncode, err) == (130, "mavherd: interrupted\n")


def test_while_the_machine_stands_still_nobody_is_waited_for(field, monkeypatch):
    wall = SimpleNamespace(monotonic=count(step=60).__next__)  # a minute from look to look
    monkeypatch.setattr("mavherd.gcs.commands.live_check.time", wall)
    with inspect(load_scenario(str(field.sandbox.folder / "field.yaml"))) as inspection:
        inspection.listen(1.0)
        assert 1.0 <= inspection.now < 2.0


def test_a_scenario_of_our_own_needs_no_waiting(sandbox):
    done = sandbox.run("check", "crossing-targets")
    assert (done.code, done.out) == (0, "crossing-targets: 6 robots, law safe: ok\n")
    done = sandbox.run("check", "crossing-targets", "--json")
    assert json.loads(done.out) == {"scenario": "crossing-targets", "ready": True, "vehicles": {}}
    done = sandbox.run("check", "crossing-targets", "--wait", "nan")
    assert done.code == 2
    assert done.complaint == "mavherd: --wait nan: expected 0..3600 s"
