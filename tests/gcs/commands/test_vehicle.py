"""`mavherd vehicle`: from options and variables to vehicles with ports, or one line why not.

Nothing is served here; `tests/e2e/test_vehicle_options.py` starts real processes.
"""

from contextlib import nullcontext

import pytest

from mavherd.gcs.cli import main
from mavherd.gcs.commands import vehicle as vehicle_command
from mavherd.vehicles import standalone
from mavherd.vehicles.process import VehicleProcess


class Listening(nullcontext):
    """Stands for a listening TCP socket."""

    def __init__(self, port):
        super().__init__(self)
        self.port = port


@pytest.fixture
def starts(monkeypatch):
    """Return what a command line would start."""
    found = []
    monkeypatch.setattr(
        standalone, "serve", lambda starts, **rest: found.append((starts, rest)) or 0
    )
    monkeypatch.setattr(vehicle_command, "listen_tcp", lambda host, port: Listening(port))
    monkeypatch.setattr("mavherd.gcs.run.ports.listen_tcp", lambda host, port: Listening(port))
    for name in ("HOME_LAT", "HOME_LON", "HOME_ALT", "SIM_SPEED_FACTOR"):
        monkeypatch.delenv(f"PX4_{name}", raising=False)

    def run(*words):
        assert main(["vehicle", *map(str, words)]) == 0
        return found[-1][0]

    run.found = found
    return run


def test_the_instance_follows_the_system_id_unless_it_is_given(starts):
    for words, tcp, api in (
        ((), 5760, 14540),
        (("--sysid", 3), 5780, 14542),
        (("--sysid", 3, "-I", 0), 5760, 14540),
        (("-I", 11), 5870, 14552),  # 14550 is left to ground stations
    ):
        (start,) = starts("rover", *words)
        assert start.tcp.port == tcp
        assert start.udpout == ["127.0.0.1:14550", f"127.0.0.1:{api}"]
        assert not start.udpin


def test_many_have_ids_names_places_and_ports_of_their_own(starts, tmp_path):
    many = starts(
        "quadcopter", "-n", 3, "--sysid", 5, "--position", "10,-4,0", "--folder", tmp_path
    )
    configs = [s.config for s in many]
    assert [c.system_id for c in configs] == [5, 6, 7]
    assert [c.name for c in configs] == ["quadcopter5", "quadcopter6", "quadcopter7"]
    assert [(c.north, c.east) for c in configs] == [(-4, 10), (-4, 13), (-4, 16)]
    assert [s.tcp.port for s in many] == [5800, 5810, 5820]
    assert [s.folder for s in many] == [tmp_path / c.name for c in configs]
    assert [s.udpout[0] for s in many] == ["127.0.0.1:14550"] * 3


def test_ports_that_are_given_are_the_only_ones(starts):
    (start,) = starts("rover", "--tcp", 6000)
    assert start.tcp.port == 6000
    (start,) = starts("rover", "--udpout", "127.0.0.1:9", "--tcp", 0)
    assert (start.tcp, start.udpin, start.udpout) == (None, [], ["127.0.0.1:9"])
    many = starts("rover", "-n", 2, "--tcp", 6000, "--udpin", "7000", "--udpin", "127.0.0.1:0")
    assert [s.tcp.port for s in many] == [6000, 6010]
    assert [s.udpin for s in many] == [
        ["127.0.0.1:7000", "127.0.0.1:0"],
        ["127.0.0.1:7001", "127.0.0.1:0"],
    ]
    assert [s.udpout for s in many] == [[], []]


def test_a_home_in_the_south_or_west_is_no_option(starts):
    (start,) = starts("rover", "--home", "-35.3,-149.2,584,90", "--position", "-1,-2,0")
    assert (start.config.origin.lat_deg, start.config.origin.lon_deg) == (-35.3, -149.2)
    assert (start.config.north, start.config.east) == (-2, -1)


def test_options_count_more_than_variables(starts, monkeypatch):
    monkeypatch.setenv("PX4_HOME_LAT", "10")
    monkeypatch.setenv("PX4_SIM_SPEED_FACTOR", "4")
    (start,) = starts("rover")
    origin = start.config.origin
    assert (origin.lat_deg, origin.lon_deg, origin.alt_m) == (10, 8.5456, 488)
    assert starts.found[-1][1]["speed"] == 4
    (start,) = starts("rover", "--home", "20,30,40,0", "--speed", "2")
    origin = start.config.origin
    assert (origin.lat_deg, origin.lon_deg, origin.alt_m) == (20, 30, 40)
    assert starts.found[-1][1]["speed"] == 2


@pytest.fixture
def complaint(monkeypatch, capfd, tmp_path):
    """Return what a command line that cannot be is answered; it must not serve anything."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken").write_text("{ no file of any kind\n")

    def never(*_, **__):
        pytest.fail("a vehicle was started")

    monkeypatch.setattr(VehicleProcess, "run_free", never)
    monkeypatch.setattr(standalone, "rear", never)

    def complain(*words):
        try:
            code = main(["vehicle", *words])
        except SystemExit as leaving:  # argparse's way
            code = leaving.code
        said = capfd.readouterr()
        (line,) = said.err.splitlines()
        assert line.startswith("mavherd: ")
        assert (code, said.out) == (2, "")
        return line

    return complain


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ("--sysid 0", "1..240"),
        ("--count 0", "--count 0: expected 1..240"),
        ("--sysid 231 --count 11", "--count 11: expected 1..10, as system ids end at 240"),
        ("-n many", "-n/--count"),
        ("-I 241", "--instance 241"),
        ("--name a/b", "--name 'a/b'"),
        ("--autopilot ardu", "'ardu'"),
        ("--profile fast", "'fast'"),
        ("--home here", "--home LAT,LON,ALT,HEADING_DEG: 'here' is not 4 numbers"),
        ("--home 91,0,0,0", "latitude 91"),
        ("--position 1,2", "--position E,N,U: '1,2' is not 3 numbers"),
        ("--speed fast", "'fast'"),
        ("--speed nan", "--speed nan: expected a factor of 0.01..100"),
        ("--param RTL_ALT=high", "RTL_ALT is not a number"),
        ("--param RTL_ALTT=1", "did you mean 'RTL_ALT'?"),
        ("--param RTL_ALT=-1", "RTL_ALT"),
        ("--params missing.param", "missing.param: cannot be read: No such file or directory"),
        ("--params .", "Is a directory"),
        ("--params /dev/zero", "/dev/zero: is too large"),
        ("--params broken", "broken:1: "),
        ("--mission missing.plan", "missing.plan: No such file or directory"),
        ("--mission /dev/zero", "/dev/zero: is too large"),
        ("--mission broken", "broken"),
        ("--folder broken", "--folder: broken: File exists"),
        ("--folder /proc/self", "/proc/self/parameters.param: cannot be written"),
        ("--wipe --folder broken/x", "Not a directory"),
        ("--tcp 65536", "'65536' is not a port"),
        ("--tcp 65530 --count 2", "--tcp 65530: vehicle 2 needs 65540"),
        ("--udpin 65535 --count 2", "--udpin 65535: vehicle 2 needs 65536"),
        ("--udpin no.such.host.invalid:5000", "udpin:no.such.host.invalid:5000: "),
        ("--udpout nowhere", "--udpout 'nowhere'"),
        ("--tcp 0 --udpout 127.0.0.1:0", "nobody can listen there"),
        ("--fly", "--fly"),
    ],
)
def test_a_wrong_option_is_told_in_one_line(complaint, options, text):
    assert text in complaint("quadcopter", "--udpin", "127.0.0.1:0", *options.split())


@pytest.mark.parametrize(
    ("variable", "text"),
    [
        ("PX4_HOME_LAT=north", "PX4_HOME_LAT: 'north,"),
        ("PX4_SIM_SPEED_FACTOR=fast", "PX4_SIM_SPEED_FACTOR=fast: expected a factor"),
        ("PX4_SIM_SPEED_FACTOR=1000", "0.01..100"),
    ],
)
def test_a_wrong_variable_is_told_in_one_line(monkeypatch, complaint, variable, text):
    name, _, value = variable.partition("=")
    monkeypatch.setenv(name, value)
    assert text in complaint("rover", "--udpin", "127.0.0.1:0")
