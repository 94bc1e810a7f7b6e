"""Modes and phases are recorded where they change, events with their level and their source."""

import pytest

pytest.importorskip("rerun")

from mavherd.gcs.recording.stage import MANY, Stage, StagedRobot
from mavherd.gcs.recording.stream import Stream
from mavherd.gcs.recording.timeline import PHASE_COLOURS, Timeline
from mavherd.transport.frames import Origin
from mavherd.transport.wire import Phase, VehicleState

STILL = (0.0, 0.0, 0.0)
ROBOTS = (StagedRobot("q1", "quadcopter", 1, STILL), StagedRobot("r2", "rover", 2, STILL))


@pytest.fixture
def recorded(tmp_path, strict, read_back):
    def make(law, fill, robots=ROBOTS):
        stream = Stream("steps", file=tmp_path / "run.rrd")
        timeline = Timeline(stream, Stage("steps", law, robots, Origin()))
        fill(timeline)
        timeline.flush()
        stream.close()
        return read_back(tmp_path / "run.rrd")

    return make


def state(name, time, mode, armed, phase):
    quaternion = (1.0, 0.0, 0.0, 0.0)
    return VehicleState(name, 1, 0, time, STILL, STILL, quaternion, mode, armed, phase)


def steps(seen, entity):
    return [(t, v[0]) for t, v in seen[entity]["StateChange:state"]]


def test_modes_and_phases_stand_where_they_changed(recorded):
    def fill(timeline):
        for tick in range(40):
            armed, phase = tick >= 10, Phase.WAITING if tick < 20 else Phase.ACTIVE
            time = tick / 10
            states = [
                state("q1", time, 4, armed, phase),
                state("r2", time, 4, armed, phase),
                state("unknown", time, 4, armed, phase),
            ]
            timeline.add_states(states)

    seen = recorded("safe", fill)
    assert steps(seen, "/mode/q1") == [(0.0, "GUIDED · disarmed"), (1.0, "GUIDED")]
    assert steps(seen, "/mode/r2") == [(0.0, "HOLD · disarmed"), (1.0, "HOLD")]
    assert steps(seen, "/phase/q1") == [(0.0, "waiting"), (2.0, "active")]
    assert "/mode/unknown" not in seen


def test_every_phase_has_a_colour_of_its_own_and_it_is_recorded(recorded):
    assert list(PHASE_COLOURS) == [phase.name.lower() for phase in Phase]
    assert len(set(PHASE_COLOURS.values())) == len(Phase)
    look = recorded("safe", lambda timeline: None)["/phase/q1"]
    assert look["StateConfiguration:values"][0][1] == list(PHASE_COLOURS)
    assert len(look["StateConfiguration:colors"][0][1]) == len(Phase)


def test_where_nobody_coordinates_there_are_no_phases_and_modes_may_be_given_in_words(recorded):
    def fill(timeline):
        timeline.add_states([state("q1", 0.0, 4, True, Phase.ACTIVE)])
        timeline.add_mode("r2", 1.0, "Cruise")
        timeline.add_mode("r2", 2.0, "Cruise")

    seen = recorded("", fill)
    assert steps(seen, "/mode/r2") == [(1.0, "Cruise")]
    assert not any(entity.startswith("/phase") for entity in seen)


@pytest.mark.parametrize(
    ("event", "line", "level"),
    [
        ({"vehicle": "q1", "kind": "text", "text": "Armed", "severity": 6}, "q1: Armed", "INFO"),
        ({"vehicle": "q1", "kind": "text", "text": "Low", "severity": 4}, "q1: Low", "WARN"),
        ({"vehicle": "q1", "kind": "text", "text": "Off", "severity": 2}, "q1: Off", "CRITICAL"),
        ({"vehicle": "q1", "kind": "phase", "text": "active"}, "q1 → active", "DEBUG"),
        ({"vehicle": None, "kind": "problem", "text": "gone"}, "gone  [problem]", "ERROR"),
        ({"vehicle": "q1", "kind": "news", "text": "hm"}, "q1: hm  [news]", "INFO"),
    ],
)
def test_an_event_says_whose_and_what_it_is_at_its_level(recorded, event, line, level):
    log = recorded("safe", lambda timeline: timeline.add_event({"t": 1.5, **event}))["/events"]
    assert log["TextLog:text"] == [(1.5, [line])]
    assert log["TextLog:level"] == [(1.5, [level])]


def test_phases_of_a_crowd_do_not_flood_the_log(recorded):
    many = tuple(StagedRobot(f"r{i}", "rover", i + 1, STILL) for i in range(MANY + 1))

    def fill(timeline):
        for kind in ("phase", "text"):
            timeline.add_event({"t": 1.0, "vehicle": "r1", "kind": kind, "text": "active"})

    log = recorded("safe", fill, many)["/events"]
    assert log["TextLog:text"] == [(1.0, ["r1: active"])]
