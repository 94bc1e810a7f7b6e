"""A run's folder is opened as it was left, whole or not; what is none is named, with the cure."""

import json
import shutil
import socket

import numpy as np
import pytest

from mavherd.gcs.flown.events import open_events
from mavherd.gcs.flown.flown import open_flown
from mavherd.gcs.flown.folder import REPORT_SCHEMA
from mavherd.gcs.report.report import SCHEMA
from mavherd.gcs.run.in_process_run import InProcessRun
from mavherd.gcs.run.open_run import RunOptions
from mavherd.gcs.run.view import Unseen
from mavherd.scenarios.loader import load_scenario
from mavherd.transport.errors import MavherdError


def refused(folder):
    with pytest.raises(MavherdError) as caught:
        open_flown(folder)
    return str(caught.value)


def rewrite(path, **changes):
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def test_a_whole_run_opens_with_all_that_it_has_left(whole_run):
    flown = open_flown(whole_run)
    assert (flown.partial, flown.missing) == (False, ())
    assert flown.report["passed"] is True
    assert flown.scenario.name == "short"
    tracks = flown.tracks()
    assert [track.name for track in tracks] == ["rover1", "rover2"]
    for track, spec in zip(tracks, flown.starts, strict=True):
        assert np.allclose(track.position[0, :2], (spec.start.east, spec.start.north), atol=1e-3)
    assert {event["kind"] for event in flown.events()} >= {"phase"}
    assert flown.tlog("rover1") == whole_run / "vehicles/rover1/rover1.tlog"
    assert flown.recording is None  # in one process nobody records
    assert not flown.goes_on()


def test_a_killed_run_opens_and_says_what_has_no_end(killed):
    flown = open_flown(killed)
    assert flown.report is None
    assert flown.missing == (
        "report.json: none (the run was killed, or goes on)",
        "truth.bin: without its end (.part) of all 2 robots",
        "tlog: without its end (.part) of all 2 robots",
    )
    assert flown.tlog("rover2") == killed / "vehicles/rover2/rover2.tlog.part"


def test_of_a_torn_truth_log_all_whole_rows_are_had(killed, whole_run):
    whole, torn = open_flown(whole_run).tracks(), open_flown(killed).tracks()
    assert [len(track) for track in torn] == [len(track) - 1 for track in whole]


def test_a_robot_that_was_killed_before_it_wrote_is_left_out(killed):
    (killed / "vehicles/rover1/truth.bin.part").write_bytes(b'{"schema"')
    (killed / "vehicles/rover1/rover1.tlog.part").unlink()
    flown = open_flown(killed)
    assert [track.name for track in flown.tracks()] == ["rover2"]
    assert "tlog: none of rover1" in flown.missing
    assert flown.tlog("rover1") is None


def test_a_finished_truth_log_that_is_none_is_not_passed_over(run_folder):
    (run_folder / "vehicles/rover1/truth.bin").write_bytes(b"what is this")
    with pytest.raises(MavherdError, match=r"rover1/truth.bin: no header line"):
        open_flown(run_folder).tracks()


def test_a_recording_without_its_end_is_told(run_folder):
    (run_folder / "run.rrd.part").write_bytes(b"")
    flown = open_flown(run_folder)
    assert flown.missing == ("run.rrd: without its end (.part)",)
    assert flown.recording == run_folder / "run.rrd.part"


def test_what_the_report_says_to_be_missing_stands(run_folder):
    rewrite(run_folder / "report.json", partial=True, missing=["the recorder was killed"])
    assert open_flown(run_folder).missing == ("the recorder was killed",)
    rewrite(run_folder / "report.json", partial=True, missing=[])
    assert open_flown(run_folder).missing == ("report.json says that the run is partial",)


def test_a_recording_that_was_converted_since_is_whole(run_folder):
    lost = "the recorder gave up: the disk is full: run.rrd.part holds what came before"
    rewrite(run_folder / "report.json", partial=True, missing=[lost, "tlog: none of rover1"])
    assert open_flown(run_folder).missing == (lost, "tlog: none of rover1")
    (run_folder / "run.rrd").write_bytes(b"RRF2")
    assert open_flown(run_folder).missing == ("tlog: none of rover1",)
    rewrite(run_folder / "report.json", missing=[lost])
    assert not open_flown(run_folder).partial


def test_a_torn_last_event_is_left_out_and_a_damaged_one_is_told(run_folder):
    log = run_folder / "events.jsonl"
    events = open_flown(run_folder).events()
    log.write_text(log.read_text() + '{"t": 3.0, "veh')
    flown = open_flown(run_folder)
    assert (flown.events(), flown.missing) == (events, ())
    lines = log.read_text().splitlines()
    lines[1:1] = ['{"t": 3.0}', "[]", '{"t": "x", "vehicle": null, "kind": "text", "text": ""}']
    log.write_text("\n".join(lines))
    flown = open_flown(run_folder)
    assert (flown.events(), flown.missing) == (events, ("events.jsonl: damaged in line 2, 3, 4",))
    log.unlink()
    flown = open_flown(run_folder)
    assert (flown.events(), flown.missing) == ((), ("events.jsonl: none",))


def test_a_run_goes_on_while_its_events_are_written(killed):
    with open_events(killed):
        assert open_flown(killed).goes_on()
    assert not open_flown(killed).goes_on()


def test_a_killed_run_whose_port_somebody_else_has_does_not_go_on(killed):
    with socket.create_server(("127.0.0.1", 0)) as other:
        endpoint = f"tcp/127.0.0.1:{other.getsockname()[1]}"
        (killed / "ports.json").write_text(json.dumps({"zenoh": endpoint}))
        assert not open_flown(killed).goes_on()


def test_a_run_in_this_process_goes_on_until_it_stops(whole_run, tmp_path):
    scenario = load_scenario(whole_run / "scenario.yaml")
    run = InProcessRun(scenario, RunOptions(out=tmp_path, record=False), Unseen(), lambda: False)
    run.start()
    assert open_flown(run.folder).goes_on()
    run.stop(hurry=True)
    assert not open_flown(run.folder).goes_on()


def test_a_folder_that_is_not_there_is_named_with_the_one_that_was_meant(run_folder):
    wrong = run_folder.with_name(run_folder.name[:-1])
    assert refused(wrong) == f"{wrong}: there is no such folder (did you mean {run_folder}?)"
    assert refused("/nowhere/at/all") == "/nowhere/at/all: there is no such folder"


def test_a_folder_of_something_else_is_named_with_what_to_give_instead(run_folder, tmp_path):
    runs = run_folder.parent
    assert f"holds 1 (give one of them; the newest is {run_folder})" in refused(runs)
    assert f"(give its folder, {run_folder})" in refused(run_folder / "report.json")
    (tmp_path / "mine").mkdir()
    assert "(it has no scenario.yaml and vehicles)" in refused(tmp_path / "mine")
    shutil.copy(run_folder / "scenario.yaml", tmp_path / "mine")
    assert "(it has no vehicles)" in refused(tmp_path / "mine")
    (tmp_path / "mine/sweep.json").write_text("{}")
    assert "the folder of a sweep" in refused(tmp_path / "mine")


def test_a_report_of_a_newer_version_is_refused_with_both_versions(run_folder):
    rewrite(run_folder / "report.json", schema=REPORT_SCHEMA + 1, version="9.1")
    text = refused(run_folder)
    assert f"made by a newer mavherd, 9.1: its schema is {REPORT_SCHEMA + 1}" in text
    assert f"reads up to {REPORT_SCHEMA} (install the newer one)" in text


def test_the_schema_that_is_written_is_the_newest_that_is_read():
    assert SCHEMA == REPORT_SCHEMA


@pytest.mark.parametrize("text", ["[]", "{", "", "{}", '{"schema": 2, "run_id"'])
def test_a_report_that_is_none_is_told_and_the_run_opens(run_folder, text):
    (run_folder / "report.json").write_text(text)
    flown = open_flown(run_folder)
    told = "report.json: damaged (`mavherd report` writes it again)"
    assert (flown.report, flown.damaged, flown.missing) == (None, told, (told,))
    assert len(flown.tracks()) == 2


def test_a_scenario_that_cannot_be_read_is_named_with_the_version_that_wrote_it(run_folder):
    scenario = run_folder / "scenario.yaml"
    scenario.write_text(scenario.read_text() + "weather: rain\n")
    assert "unknown key" in refused(run_folder)
    rewrite(run_folder / "report.json", version="9.1")
    assert "the run was made by mavherd 9.1, this is" in refused(run_folder)


def test_a_truth_log_of_a_newer_version_is_refused(run_folder):
    log = run_folder / "vehicles/rover1/truth.bin"
    log.write_bytes(log.read_bytes().replace(b'"schema": 1', b'"schema": 99', 1))
    with pytest.raises(MavherdError, match="truth log schema 99, this program reads"):
        open_flown(run_folder).tracks()
