"""A run lasts as long as its scenario says, to the tick, however many ticks go at once."""

import json
import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import pytest

from mavherd.gcs.run import clock_desk
from mavherd.gcs.run import drive as drive_module
from mavherd.gcs.run.conductor import CoordinatorHandle, Interrupted, Lockstep
from mavherd.gcs.run.drive import drive
from mavherd.gcs.run.launcher import Run
from mavherd.gcs.run.open_run import RunOptions
from mavherd.gcs.run.showing import Showing
from mavherd.gcs.run.view import Unseen
from mavherd.scenarios.loader import load_scenario
from mavherd.transport.bus import Bus


class Willing(Lockstep):
    """A clock that does all ticks which it is granted; `grants` are those."""

    def __init__(self):
        super().__init__([], [CoordinatorHandle("c", None, [])], lambda: False, print)
        self.grants = []

    def advance(self, period_us, most=1, wall_s=0.02):
        self.grants.append(most)
        self.now += most * period_us * 1e-6
        self.ticks += most
        return most


class Stage:
    """A run of a given length without robots."""

    def __init__(self, endpoint, **options):
        self.clock = Willing()
        self.options = RunOptions(**options)
        self.endpoint = endpoint
        self.signals = 0

    def run(self, duration, meanwhile=None):
        scenario = replace(load_scenario("one-rover"), duration=duration)
        with Bus.router(self.endpoint, "run1", reliable=True) as bus:
            self.bus = bus
            run = SimpleNamespace(bus=bus, scenario=scenario, options=self.options, note=print)
            other = threading.Thread(target=meanwhile) if meanwhile else None
            if other:
                other.start()
            try:
                drive(run, self.clock, Showing(Unseen(), list), lambda: self.signals)
            finally:
                if other:
                    other.join()
        return run


@pytest.fixture
def wall(monkeypatch):
    """A wall clock that stands but for sleeps, which are as long as they shall be."""
    now = [100.0]

    def sleep(seconds):
        now[0] += seconds

    clock = SimpleNamespace(monotonic=lambda: now[0], sleep=sleep)
    for module in (clock_desk, drive_module):
        monkeypatch.setattr(module, "time", clock)


@pytest.mark.parametrize("speed", [None, 1000.0])
@pytest.mark.parametrize(("duration", "ticks"), [(60.0, 1200), (3.33, 67), (0.05, 1), (0.01, 1)])
@pytest.mark.usefixtures("wall")
def test_not_one_tick_more_than_the_scenario_lasts(endpoint, duration, ticks, speed):
    stage = Stage(endpoint, speed=speed)
    stage.run(duration)
    assert stage.clock.ticks == ticks
    assert (len(stage.clock.grants) == 1) == (speed is None or ticks == 1)


def test_a_paused_run_ends_at_once_when_the_user_has_enough(endpoint):
    stage = Stage(endpoint, paused=True)

    def lose_patience():
        stage.signals = 1

    with pytest.raises(Interrupted):
        stage.run(60.0, lose_patience)
    assert stage.clock.ticks == 0


def test_who_listens_to_the_clock_hears_of_each_tick(endpoint):
    stage = Stage(endpoint, paused=True)
    heard = []

    def listen():
        with Bus.client(endpoint, "run1") as client:
            ticks = client.queue("clock")
            while not client.ask("clock/command", "status", 5.0):
                pass  # the desk is not open yet
            publisher = stage.bus.publisher("clock")
            while not publisher.wanted:
                time.sleep(0.005)
            client.ask("clock/command", "resume", 5.0)
            while ticks.received < 200:
                time.sleep(0.005)
            heard.extend(float(payload) for _, payload in ticks.drain())

    stage.run(10.0, listen)
    assert stage.clock.ticks == 200
    assert heard == pytest.approx([0.05 * n for n in range(1, 201)])


def test_time_that_stood_still_is_no_part_of_what_a_run_took(endpoint):
    stage = Stage(endpoint, paused=True)
    waited = threading.Event()

    def go_on():
        with Bus.client(endpoint, "run1") as client:
            while not client.ask("clock/command", "status", 5.0):
                pass
            waited.wait(0.3)  # nobody sets it
            client.ask("clock/command", "resume", 5.0)

    began = time.monotonic()
    run = stage.run(1.0, go_on)
    assert 0 < run.wall_s < time.monotonic() - began - 0.3


@pytest.mark.parametrize("steps", [20, 21, 400])
def test_steps_that_outlive_the_run_are_answered_when_it_ends(endpoint, steps):
    stage = Stage(endpoint, paused=True)
    answers = []

    def step():
        with Bus.client(endpoint, "run1") as client:
            while not client.ask("clock/command", "status", 5.0):
                pass
            answers.append(client.ask("clock/command", f"step {steps}", 60.0))

    stage.run(1.0, step)
    assert stage.clock.ticks == 20
    assert answers[0].granted
    assert json.loads(answers[0].text)["t"] == 1.0


class Witness(Unseen):
    """A view that keeps what it was shown."""

    def __init__(self):
        self.seen = []

    def update(self, now, states, going):
        self.seen.append((now, states, going.clock))


@pytest.mark.parametrize("coordinators", ["central", "per-robot"])
def test_a_view_sees_the_whole_team_of_a_run_in_process(tmp_path, coordinators):
    scenario = load_scenario("crossing-targets", [f"team.coordinators={coordinators}"])
    witness = Witness()
    options = RunOptions(in_process=True, out=tmp_path, figures=False, speed=12.0)
    report = Run(replace(scenario, duration=12.0), options, witness).execute().report
    assert report["duration_s"] == 12.0
    now, states, clock = witness.seen[-1]
    assert 0 < now <= 12.0
    assert clock == "speed 12"
    assert [state.system_id for state in states] == [1, 2, 3, 4, 5, 6]
