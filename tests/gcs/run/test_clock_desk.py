"""Orders that come over the bus are answered or refused, and told as events; time is published."""

import json
import threading
import time
from contextlib import contextmanager

import pytest

from mavherd.gcs.run.clock_control import FREE, ClockControl
from mavherd.gcs.run.clock_desk import OVER, ClockDesk
from mavherd.transport.bus import Bus

PATIENCE = 60.0


@pytest.fixture
def buses(endpoint):
    with Bus.router(endpoint, "run1") as router, Bus.client(endpoint, "run1") as client:
        yield router, client


class Desk:
    """A desk, and a run that ticks as it may; `ask` is somebody elsewhere."""

    def __init__(self, buses, control):
        router, self.client = buses
        self.control = control
        self.events = []
        self.desk = ClockDesk(router, control, self.events.append)
        self.over = False

    def ask(self, order):
        answer = self.client.ask("clock/command", order, PATIENCE)
        assert answer is not None
        return answer.granted, json.loads(answer.text) if answer.granted else answer.text

    def run(self):
        while not self.over:
            self.desk.attend(self.control.now if self.control else 7.0)
            if self.control is None or self.control.due > time.monotonic():
                self.desk.wait(time.monotonic() + 0.01)
            else:
                now = self.control.now + 0.05
                self.desk.tick(now)
                self.control.ticked(now, time.monotonic())


@contextmanager
def running(buses, control):
    desk = Desk(buses, control)
    thread = threading.Thread(target=desk.run)
    thread.start()
    try:
        yield desk
    finally:
        desk.over = True
        thread.join()


def paused():
    return ClockControl(0.05, None, paused=True, wall=time.monotonic())


def test_an_order_is_answered_with_how_the_clock_stands_then(buses):
    with running(buses, paused()) as desk:
        assert desk.ask("status") == (True, {"t": 0.0, "paused": True, "speed": "max"})
        assert desk.ask("speed 500") == (True, {"t": 0.0, "paused": True, "speed": 500.0})
        granted, state = desk.ask("resume")
        assert (granted, state["paused"]) == (True, False)
        granted, state = desk.ask("pause")
        assert (granted, state["paused"]) == (True, True)
    assert [e["text"] for e in desk.events] == ["speed 500", "resume", "pause"]
    assert {e["kind"] for e in desk.events} == {"clock"}


def test_steps_are_answered_when_they_are_done(buses):
    with running(buses, paused()) as desk:
        assert desk.ask("step 20") == (True, {"t": 1.0, "paused": True, "speed": "max"})
        assert desk.ask("step") == (True, {"t": 1.05, "paused": True, "speed": "max"})


def test_capitals_and_spaces_make_no_difference(buses):
    with running(buses, paused()) as desk:
        assert desk.ask(" STEP  20\n") == (True, {"t": 1.0, "paused": True, "speed": "max"})
        assert desk.ask("Speed MAX")[0]
    assert [e["text"] for e in desk.events] == ["step 20"]


def test_steps_that_are_called_off_are_refused_with_who_did_it(buses):
    control = ClockControl(0.05, 0.01, paused=True, wall=time.monotonic())  # 5 s for each
    with running(buses, control) as desk:
        answers = []
        waiting = threading.Thread(target=lambda: answers.append(desk.ask("step 100")))
        waiting.start()
        while not control.stepping:
            time.sleep(0.005)
        assert desk.ask("pause")[1]["paused"]
        waiting.join()
    ((granted, said),) = answers
    assert not granted
    assert said.startswith("step 100: called off by 'pause' at ")


def test_who_asks_when_all_is_over_is_told_so(buses):
    router, client = buses
    heard = []
    desk = ClockDesk(router, paused(), heard.append)
    answers = []
    asking = threading.Thread(
        target=lambda: answers.append(client.ask("clock/command", "pause", PATIENCE))
    )
    asking.start()
    while not answers:  # the order is under way, at first
        desk.close()
        time.sleep(0.005)
    asking.join()
    assert answers == [(False, OVER)]
    assert not heard


def test_garbage_is_refused_with_a_reason_and_an_event(buses):
    with running(buses, paused()) as desk:
        granted, reason = desk.ask("jump\x1b[2J" + "x" * 5000)
        assert not granted
        assert "is no command of the clock (pause, resume" in reason
        assert desk.ask("status")[1] == {"t": 0.0, "paused": True, "speed": "max"}
        raw = desk.client._session.get("mavherd/run1/clock/command", payload=bytes(range(256)))
        assert [reply.ok for reply in raw] == [None]
        raw = desk.client._session.get("mavherd/run1/clock/command")  # with no payload at all
        assert [reply.ok for reply in raw] == [None]
    assert [e["kind"] for e in desk.events] == ["clock"] * 3
    assert all(e["text"].startswith("refused: ") for e in desk.events)
    assert all(e["text"].isprintable() for e in desk.events)


def test_a_free_running_team_has_no_clock_to_command(buses):
    with running(buses, None) as desk:
        for order in ("pause", "status", "nonsense"):
            assert desk.ask(order) == (False, FREE)
    assert desk.events[0] == {
        "t": 7.0,
        "vehicle": None,
        "kind": "clock",
        "text": f"refused: {FREE}",
    }


def test_time_and_state_are_published(buses):
    _, client = buses
    ticks, states = client.queue("clock"), client.latest("clock/state")
    with running(buses, paused()) as desk:
        while not states.arrived.wait(0.01):  # said again and again, for whoever comes late
            pass
        assert json.loads(states.latest["clock/state"])["paused"]
        while not desk.desk._ticks.wanted:
            time.sleep(0.005)
        desk.ask("step 3")
        while ticks.received < 3:
            time.sleep(0.005)
        assert [payload for _, payload in ticks.drain()] == [b"0.050000", b"0.100000", b"0.150000"]
        desk.ask("speed 2")
        while json.loads(states.latest["clock/state"])["speed"] != 2.0:
            time.sleep(0.005)
