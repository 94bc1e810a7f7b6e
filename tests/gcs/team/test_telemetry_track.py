"""What an external vehicle tells becomes a track like a truth log, marked as what it is."""

import numpy as np
import pytest

from mavherd.gcs.report.judge import judge
from mavherd.gcs.report.report import RunFacts, build_report
from mavherd.gcs.report.truth import read_truth
from mavherd.gcs.station import VehicleStatus
from mavherd.gcs.team.telemetry_track import TelemetryTrack
from mavherd.scenarios.schema import Goto, Point, RobotSpec, Scenario
from mavherd.transport.frames import quaternion_from_euler, quaternion_to_enu, yaw_of

SPEC = RobotSpec(
    name="rover1",
    kind="rover",
    system_id=7,
    start=Point(0, 0),
    path=Goto(target=Point(2, 4)),
    connect="tcp:127.0.0.1:5760",
)


def told(at, north=0.0, east=0.0, yaw=0.0):
    return VehicleStatus(
        position_at=at,
        position=(north, east, 0.0),
        velocity=(2.0, 1.0, 0.0),
        quaternion=quaternion_from_euler(0, 0, yaw),
    )


def write(folder, *statuses):
    track = TelemetryTrack(folder, SPEC)
    for status in statuses:
        track.add(status)
    track.close()
    return read_truth(folder / "truth.bin")


def test_it_is_interpolated_to_the_rate_of_truth(tmp_path):
    track = write(tmp_path, *(told(0.053 * k, 2 * 0.053 * k, 0.053 * k) for k in range(38)))
    assert track.source == "telemetry"
    assert (track.name, track.kind, track.system_id) == ("rover1", "rover", 7)
    assert np.diff(track.time) == pytest.approx(0.01)
    assert track.time[[0, -1]] == pytest.approx([0.01, 1.96])
    assert track.position[:, 1] == pytest.approx(2 * track.time)  # north
    assert track.position[:, 0] == pytest.approx(track.time)
    assert track.velocity[5] == pytest.approx([1, 2, 0])
    assert np.isnan(track.rates).all()  # nobody has told them


def test_attitudes_turn_the_short_way_whatever_the_sign(tmp_path):
    there = told(0.1, yaw=0.4)
    there.quaternion = tuple(-q for q in there.quaternion)  # the same attitude
    track = write(tmp_path, told(0.0, yaw=0.2), there)
    assert np.linalg.norm(track.quaternion, axis=1) == pytest.approx(1.0)
    halfway = yaw_of(quaternion_to_enu(quaternion_from_euler(0, 0, 0.3)))
    assert yaw_of(track.quaternion[4]) == pytest.approx(halfway, abs=1e-6)


def test_what_is_not_known_or_not_new_adds_nothing(tmp_path):
    assert len(write(tmp_path, told(-1.0), told(-1.0))) == 0
    assert len(write(tmp_path, told(0.0), told(0.02), told(0.02), told(0.02))) == 2


def test_it_is_complete_or_visibly_partial(tmp_path):
    track = TelemetryTrack(tmp_path, SPEC)
    assert [path.name for path in tmp_path.iterdir()] == ["truth.bin.part"]
    track.close()
    assert [path.name for path in tmp_path.iterdir()] == ["truth.bin"]


def test_the_report_says_who_is_judged_by_its_own_word(tmp_path):
    track = write(tmp_path, *(told(0.05 * k, 0.1 * k, 0.05 * k) for k in range(41)))
    scenario = Scenario(name="field", robots=(SPEC,))
    verdict = judge(scenario, (SPEC,), [track], 0.0, 2.0)
    facts = RunFacts(
        run_id="x", seed=1, law="safe", lockstep=False, speed=1.0, duration_s=2.0, wall_s=2.0,
        real_time_factor=1.0, digest=None,
    )  # fmt: skip
    (robot,) = build_report(scenario, verdict, facts)["robots"]
    assert robot["arrived"]
    assert robot["source"] == "telemetry"
