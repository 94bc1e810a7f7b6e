"""`mavherd run`: which vehicles it flies, on which clock, and with whose leave."""

import pytest

from mavherd.gcs.cli import main
from mavherd.gcs.run import keys, launcher
from mavherd.transport.errors import MavherdError

EXTERNAL = "--set=robots.quad1.connect={}"
LOOPBACK = EXTERNAL.format("udpin:127.0.0.1:14550")
REAL = EXTERNAL.format("udpin:0.0.0.0:14550")
FENCE = "--set=fence={east: [-20, 20], north: [-20, 20], up: 10}"


class BeginsError(MavherdError):
    """Stands for the run that would begin here."""

    def __init__(self, scenario, options, view=None):
        self.scenario, self.options = scenario, options
        super().__init__("begins")


@pytest.fixture
def begins(monkeypatch, capsys):
    """Return what a command line would run: scenario, options, and what is said on stderr."""
    made = []

    class Recorder:
        def __init__(self, *args):
            self.started = BeginsError(*args[:3])

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        def execute(self):
            made.append(self.started)
            raise self.started

    monkeypatch.setattr(launcher, "Run", Recorder)

    def run(*words):
        assert main(["run", *words]) == 2
        said = capsys.readouterr().err
        return made[-1].scenario, made[-1].options, said

    return run


@pytest.fixture
def refused(monkeypatch, capsys):
    """Return the one line with which a command line is refused before anything is started."""
    monkeypatch.setattr(launcher, "Run", None)

    def run(*words):
        assert main(["run", *words]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        return line

    return run


def test_our_own_vehicles_run_in_lockstep_and_nothing_is_said(begins):
    _, options, said = begins("one-quad")
    assert options.lockstep
    assert said == "mavherd: begins\n"


@pytest.mark.parametrize("stack", ["ardupilot", "px4", "generic"])
def test_the_flight_stack_of_our_own_can_be_chosen(begins, stack):
    scenario, _, _ = begins("crossing-targets", "--autopilot", stack)
    assert {spec.autopilot for spec in scenario.robots} == {stack}


def test_with_an_external_vehicle_the_team_runs_free_and_one_line_says_so(begins):
    scenario, options, said = begins("one-quad", LOOPBACK)
    assert scenario.robots[0].external
    assert not options.lockstep
    assert options.speed == 1.0
    assert said.splitlines()[0] == ("note: the team runs free, on the wall clock; external: quad1")


def test_external_vehicles_cannot_be_hurried(refused):
    assert "--speed: free-running follows" in refused("one-quad", LOOPBACK, "--speed", "3")


def test_a_clock_cannot_be_forced_on_external_vehicles(refused):
    assert "--lockstep: quad1 cannot be conducted" in refused("one-quad", LOOPBACK, "--lockstep")


@pytest.mark.parametrize(
    ("words", "confirm", "fence"),
    [((), True, True), (("--confirm",), False, True), ((FENCE,), True, False)],
)
def test_what_may_be_real_needs_leave_and_a_fence(refused, words, confirm, fence):
    line = refused("one-quad", REAL, *words)
    assert line.startswith("mavherd: quad1 (udpin:0.0.0.0:14550): not on this machine's loopback")
    assert ("say --confirm" in line) == confirm
    assert ("fence: {east:" in line) == fence


@pytest.mark.parametrize(
    "address", ["udpin:0.0.0.0:14550", "tcp:10.0.0.7:5760", "serial:/dev/ttyUSB0", "tcp:drone:5760"]
)
def test_with_leave_and_a_fence_real_vehicles_fly(begins, address):
    scenario, _, _ = begins("one-quad", EXTERNAL.format(address), FENCE, "--confirm")
    assert scenario.robots[0].connect == address


def test_vehicles_on_loopback_need_neither(begins):
    for address in ("tcp:127.0.0.1:5760", "tcp:localhost:5760", "udpin:127.0.0.3:14550"):
        begins("one-quad", EXTERNAL.format(address))


def test_a_run_can_begin_paused_and_at_a_speed(begins):
    _, options, _ = begins("one-quad", "--paused", "--speed", "2.5")
    assert options.paused
    assert options.speed == 2.5
    _, options, _ = begins("one-quad", "--speed", "max")
    assert not options.paused
    assert options.speed is None


def test_who_begins_paused_in_one_process_needs_keys_to_resume_it(refused, monkeypatch):
    words = "one-quad", "--in-process", "--paused"
    monkeypatch.setattr(keys, "keys_of_terminal", lambda: None)
    assert refused(*words).startswith("mavherd: --paused: with --in-process only the keys")


def test_at_a_terminal_a_run_in_one_process_can_begin_paused(begins, monkeypatch):
    monkeypatch.setattr(keys, "keys_of_terminal", lambda: keys.Keys(0))
    _, options, _ = begins("one-quad", "--in-process", "--paused")
    assert options.paused
    assert options.in_process


@pytest.mark.parametrize("option", ["--paused", "--in-process"])
def test_what_only_lockstep_can_do_is_refused_when_running_free(refused, option):
    for free in ("--free-run", LOOPBACK):
        assert f"{option}: the team runs free" in refused("one-quad", free, option)


@pytest.mark.parametrize("option", ["--paused", "--in-process"])
def test_what_an_external_vehicle_rules_out_names_its_connect_and_the_cure(refused, option):
    line = refused("one-quad", LOOPBACK, option)
    assert line.startswith(f"mavherd: {option}: ")
    assert "robots.quad1.connect" in line
    assert line.endswith(f"(leave out {option}, or `connect`)")
