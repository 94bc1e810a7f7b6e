"""`mavherd report` writes the same report of a whole run, and an honest one of a killed run."""

import json
from pathlib import Path

import pytest

from mavherd.gcs.cli import main
from mavherd.gcs.flown.again import judge_again
from mavherd.gcs.flown.flown import open_flown
from mavherd.gcs.recording.replay import find_recording

CLOCKED = {"wall_s": 77.5, "real_time_factor": 3.25, "late_ticks": 4, "outside_clients": 2}


def reported(folder):
    return json.loads((folder / "report.json").read_text())


def rewrite(folder, **changes):
    (folder / "report.json").write_text(json.dumps(reported(folder) | changes))


def test_of_a_whole_run_the_same_report_comes_out(whole_run):
    assert judge_again(open_flown(whole_run)).report == reported(whole_run)


def test_everything_is_written_again_and_the_exit_code_is_the_runs(run_folder, capsys):
    text = (run_folder / "report.json").read_text()
    for name in ("report.html", "states.parquet", "events.parquet"):
        (run_folder / name).unlink()
    assert main(["report", "--json", str(run_folder)]) == 0
    assert (run_folder / "report.json").read_text() == text
    assert capsys.readouterr().out == text
    written = {path.name for path in run_folder.iterdir()}
    assert written >= {"report.html", "states.parquet", "events.parquet", "figures"}
    assert not list(run_folder.glob("*.part"))


def test_what_only_the_run_knew_is_kept(run_folder):
    rewrite(run_folder, **CLOCKED, python="2.7", run_id="as-it-was")
    report = judge_again(open_flown(run_folder)).report
    assert report.items() >= {**CLOCKED, "python": "2.7", "run_id": "as-it-was"}.items()


def test_a_verdict_that_the_logs_do_not_bear_out_is_mended(run_folder):
    rewrite(run_folder, passed=False, exit_code=1, collisions=7)
    report = judge_again(open_flown(run_folder)).report
    assert (report["passed"], report["exit_code"], report["collisions"]) == (True, 0, 0)


@pytest.mark.parametrize(("code", "error"), [(4, "timed out"), (130, "interrupted"), (3, "died")])
def test_how_a_run_has_ended_stays(run_folder, code, error):
    rewrite(run_folder, passed=False, exit_code=code, error=error)
    assert main(["report", str(run_folder)]) == code
    report = reported(run_folder)
    assert (report["exit_code"], report["error"], report["passed"]) == (code, error, False)


def test_a_report_of_the_first_schema_is_brought_up_to_date(run_folder, whole_run):
    old = reported(run_folder)
    for key in ("started_at", "fleet", "cpu", "missing", "in_process"):
        del old[key]
    (run_folder / "report.json").write_text(json.dumps(old | {"schema": 1}))
    report = judge_again(open_flown(run_folder)).report
    new = reported(whole_run)
    assert report["schema"] == new["schema"]
    assert report["fleet"] == new["fleet"]
    assert report["cpu"]["total_s"] is None


def test_a_killed_run_gets_a_report_that_says_what_is_missing(killed, whole_run, capsys):
    assert main(["report", str(killed)]) == 3
    assert "the run was killed: it left no report" in capsys.readouterr().err
    report, whole = reported(killed), reported(whole_run)
    assert (report["passed"], report["partial"], report["exit_code"]) == (False, True, 3)
    assert report["missing"][0] == "report.json: none was left; this one is made of the logs"
    assert report["missing"][1] == "truth.bin: without its end (.part) of all 2 robots"
    assert report["ready_at_s"] == whole["ready_at_s"]
    assert report["duration_s"] == pytest.approx(whole["duration_s"], abs=0.02)
    assert report["digest"] is None
    for key in ("wall_s", "real_time_factor", "started_at", "late_ticks", "outside_clients"):
        assert report[key] is None
    assert (report["script"], whole["script"]) == (None, False)
    assert [a["passed"] for a in report["assertions"]] == [None]
    for name, told in zip(("rover1", "rover2"), report["robots"], strict=True):
        assert told["name"] == name
        assert told["link"]["from_vehicle_frames"] > 0
    assert "killed" in (killed / "report.html").read_text()


def test_the_tables_of_a_killed_run_say_that_they_are_partial(killed):
    pq = pytest.importorskip("pyarrow.parquet")
    assert main(["report", str(killed)]) == 3
    schema = pq.read_schema(killed / "states.parquet")
    assert schema.metadata[b"partial"] == b"true"


def test_a_killed_run_is_reported_twice_alike(killed):
    codes = main(["report", str(killed)]), main(["report", str(killed)])
    first = reported(killed)
    assert codes == (3, 3)
    main(["report", str(killed)])
    assert reported(killed) == first


def test_logs_that_were_changed_after_the_run_are_told(run_folder, capsys):
    rewrite(run_folder, digest="ab" * 32)
    assert main(["report", str(run_folder)]) == 0
    assert "not abababababababab (they were changed)" in capsys.readouterr().err


def test_a_damaged_report_is_written_anew_and_says_so(run_folder, capsys):
    (run_folder / "report.json").write_text('{"schema": 2, "run_id"')
    assert main(["report", str(run_folder)]) == 3
    assert "how the run ended is not known" in capsys.readouterr().err
    told = reported(run_folder)
    assert told["missing"] == ["report.json: a damaged one was left; this one is made of the logs"]
    assert told["collisions"] == 0


def test_what_cannot_be_reported_is_refused(tmp_path, capsys):
    assert main(["report", str(tmp_path / "nowhere")]) == 2
    assert "there is no such folder" in capsys.readouterr().err


def test_the_report_of_a_killed_run_keeps_to_the_schema(killed):
    jsonschema = pytest.importorskip("jsonschema")
    schema = Path(__file__).parents[3] / "docs" / "report.schema.json"
    report = judge_again(open_flown(killed)).report
    jsonschema.validate(report, json.loads(schema.read_text()))


def test_a_converted_run_lacks_no_recording_any_more(killed):
    pytest.importorskip("rerun")
    (killed / "run.rrd.part").write_bytes(b"RRF2")
    assert "run.rrd: without its end (.part)" in open_flown(killed).missing
    assert main(["report", str(killed)]) == 3
    assert main(["convert", str(killed)]) == 0
    assert not list(killed.glob("*run.rrd.*"))
    assert not [text for text in open_flown(killed).missing if "run.rrd" in text]


def test_a_run_with_a_damaged_report_is_converted_and_shown_with_a_note(run_folder, capsys):
    pytest.importorskip("rerun")
    (run_folder / "report.json").write_text("{")
    assert main(["convert", str(run_folder)]) == 0
    assert "report.json: damaged (`mavherd report` writes it again)" in capsys.readouterr().err
    assert find_recording(run_folder).note.endswith("writes it again)")
