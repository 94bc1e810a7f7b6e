"""`mavherd digest`: the digest of whole logs, and of no others."""

import json

import pytest

from mavherd.gcs.cli import main
from mavherd.scenarios.dump import scenario_to_yaml
from mavherd.scenarios.schema import Point, RobotSpec, Scenario
from mavherd.transport.mavlink import Codec, mav
from mavherd.transport.tlog import TlogWriter, digest


@pytest.fixture
def folder(tmp_path):
    """Return what a run would leave of one rover's link."""
    (tmp_path / "vehicles/rover1").mkdir(parents=True)
    log = TlogWriter(tmp_path / "vehicles/rover1/rover1.tlog")
    for frame in Codec(1).frames([mav.MAVLink_statustext_message(6, b"a"), told(b"b")]):
        log.write(1, frame)
    log.close()
    rover = RobotSpec(name="rover1", kind="rover", system_id=1, start=Point(0, 0))
    scenario = Scenario(name="one", robots=(rover,))
    (tmp_path / "scenario.yaml").write_text(scenario_to_yaml(scenario))
    report(tmp_path, digest=digest([tmp_path / "vehicles/rover1/rover1.tlog"]))
    return tmp_path


def told(text):
    return mav.MAVLink_statustext_message(6, text)


def report(folder, **facts):
    (folder / "report.json").write_text(json.dumps({"lockstep": True, **facts}))


@pytest.fixture
def refused(folder, capsys):
    """Return the one line with which the folder is refused."""

    def run():
        assert main(["digest", str(folder)]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        (line,) = err.splitlines()
        return line

    return run


def test_of_whole_logs_it_is_the_one_in_the_report(folder, capsys):
    assert main(["digest", str(folder)]) == 0
    out, err = capsys.readouterr()
    assert out.strip() == json.loads((folder / "report.json").read_text())["digest"]
    assert err == ""


def test_a_torn_log_is_named_with_the_byte(folder, refused):
    log = folder / "vehicles/rover1/rover1.tlog"
    whole = log.read_bytes()
    log.write_bytes(whole[:-11])
    assert f"rover1.tlog: torn at byte {len(whole) // 2}, where the last" in refused()
    log.write_bytes(b"")
    assert "rover1.tlog: empty" in refused()


def test_logs_that_do_not_give_the_reports_digest_are_told(folder, capsys):
    log = folder / "vehicles/rover1/rover1.tlog"
    log.write_bytes(log.read_bytes()[: log.stat().st_size // 2])  # a whole message less
    assert main(["digest", str(folder)]) == 0
    out, err = capsys.readouterr()
    assert out.strip() == digest([log])
    assert f"its logs give {digest([log])[:16]}" in err


def test_a_free_run_has_no_digest(folder, refused):
    report(folder, lockstep=False, digest=None)
    assert "was free, on the wall clock, and has no digest" in refused()


def test_a_run_that_left_none_has_no_digest(folder, refused):
    report(folder, digest=None)
    assert "left no digest" in refused()


def test_a_newer_run_is_refused(folder, refused):
    report(folder, schema=99, version="9.0")
    assert "report.json: made by a newer mavherd, 9.0" in refused()


def test_a_report_of_something_else_is_told_of_and_not_needed(folder, capsys):
    (folder / "report.json").write_text("[]")
    assert main(["digest", str(folder)]) == 0
    out, err = capsys.readouterr()
    assert out.strip() == digest([folder / "vehicles/rover1/rover1.tlog"])
    assert "report.json: damaged" in err


def test_a_log_that_is_missing_is_named(folder, refused):
    log = folder / "vehicles/rover1/rover1.tlog"
    log.rename(log.with_name("rover1.tlog.part"))
    assert f"{log}: No such file or directory (is {folder} a finished run's folder?)" in refused()
