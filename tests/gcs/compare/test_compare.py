"""`mavherd compare` says in a table, a page and a recording how runs differ."""

import json
import re
from html.parser import HTMLParser
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from mavherd.gcs.cli import main
from mavherd.gcs.compare import compare as compare_module
from mavherd.gcs.compare.figures import look
from mavherd.gcs.compare.lineup import line_up
from mavherd.gcs.compare.measures import standings
from mavherd.gcs.compare.nearness import nearness
from mavherd.gcs.compare.table import comparison
from mavherd.gcs.compare.words import NONE
from mavherd.transport.errors import MavherdError


@pytest.fixture(scope="module")
def written(laws, tmp_path_factory):
    """The comparison of the two laws, on disk."""
    out = tmp_path_factory.mktemp("out") / "laws"
    assert main(["compare", *map(str, laws), "-o", str(out)]) == 0
    return out


@pytest.fixture
def told(capsys, tmp_path, monkeypatch):
    """Compare runs at a terminal of a hundred columns; return exit code and what it says."""
    monkeypatch.setenv("COLUMNS", "100")

    def compare(*runs):
        code = main(["compare", *map(str, runs), "-o", str(tmp_path / "out"), "--force"])
        return code, capsys.readouterr().err

    return compare


def row(text, head):
    """Return the cells of a line of the table."""
    (line,) = (line for line in text.splitlines() if line.startswith(head))
    return re.split(r"\s{2,}", line.strip())[1:]


def test_the_table_names_runs_by_what_differs_and_marks_the_best(told, laws):
    code, text = told(*laws)
    assert code == 0
    assert re.search(r"^ +law=off +law=safe *$", text, re.M)
    assert row(text, "verdict") == ["FAIL", "PASS"]
    assert row(text, "collisions") == ["1", "0 ★"]
    assert row(text, "team.law") == ["off", "safe"]
    nearest = row(text, "nearest two rovers")
    assert float(nearest[0]) < 0.79 <= float(nearest[1].split()[0])


def test_json_has_the_same_alone(laws, tmp_path, capsys):
    assert main(["compare", "--json", *map(str, laws), "-o", str(tmp_path / "out")]) == 0
    data = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert data == json.loads((tmp_path / "out/compare.json").read_text())
    assert [run["label"] for run in data["runs"]] == ["law=off", "law=safe"]
    assert data["settings"] == {"team.law": {"law=off": "off", "law=safe": "safe"}}
    hits = next(m for m in data["measures"] if m["key"] == "collisions")
    assert hits["values"] == {"law=off": 1, "law=safe": 0}
    assert (hits["best"], hits["worst"], hits["better"]) == (["law=safe"], [], "low")


class Page(HTMLParser):
    def __init__(self):
        super().__init__()
        self.text, self.sources, self.open = "", [], []

    def handle_starttag(self, tag, attrs):
        self.sources += [value for key, value in attrs if key in ("src", "href")]
        if tag not in ("meta", "br", "img", "path", "use"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in ("path", "use"):
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def test_the_page_is_whole_and_loads_nothing(written):
    page = Page()
    page.feed((written / "compare.html").read_text())
    assert page.open == []
    assert all(source.startswith(("#", "data:")) for source in page.sources)
    for text in ("2 runs of meeting", "law=off", "1 of 2 passed", "team.law", "mavherd diff"):
        assert text in page.text
    assert not list(written.rglob("*.part"))


def test_the_page_shows_hostile_names_as_they_are(copies, tmp_path):
    for run in copies:
        scenario = run / "scenario.yaml"
        text = scenario.read_text().replace("name: meeting", "name: meeting\ndescription: x", 1)
        scenario.write_text(text.replace("description: x", f"description: '<b>{run.name}'"))
    assert main(["compare", *map(str, copies), "-o", str(tmp_path / "out")]) == 0
    html = (tmp_path / "out/compare.html").read_text()
    assert "&lt;b&gt;" in html
    assert "<b>meeting" not in html


def test_the_recording_has_all_runs_on_one_timeline(written, laws):
    reader = pytest.importorskip("rerun.chunk").RrdReader(str(written / "compare.rrd"))
    rows = {}
    times = {}
    for chunk in reader.stream():
        if chunk.is_static or "sim_time" not in chunk.timeline_names:
            rows.setdefault(chunk.entity_path, 0)
            continue
        batch = chunk.to_record_batch()
        rows[chunk.entity_path] = rows.get(chunk.entity_path, 0) + batch.num_rows
        values = batch["sim_time"].cast("int64").to_numpy() * 1e-9
        times.setdefault(chunk.entity_path, []).append(values)
    found = line_up(laws)
    for label, run in zip(("law=off", "law=safe"), found.runs, strict=True):
        branch = label.replace("=", "\\=")
        for robot in ("rover1", "rover2"):
            pose = f"/world/{branch}/{robot}"
            assert rows[pose] > 50
            assert np.concatenate(times[pose]).min() == pytest.approx(-run.ready_at, abs=0.06)
        assert f"/world/{branch}/tracks" in rows
        assert rows[f"/separation/rover-rover/{branch}"] == len(nearness(run).time)
    assert "/world/law\\=off/collisions" in rows
    assert "/world/law\\=safe/collisions" not in rows


def test_separation_over_time_agrees_with_the_judge(laws):
    for run in line_up(laws).runs:
        (told,) = run.report["classes"]
        smallest = np.nanmin(nearness(run).smallest["rover-rover"])
        assert smallest == pytest.approx(told["min_separation_m"], abs=0.02)


def test_a_killed_run_is_judged_by_its_logs_and_told(told, copies):
    (copies[1] / "report.json").unlink()
    log = copies[1] / "vehicles/rover1/truth.bin"
    log.rename(log.with_name("truth.bin.part"))
    code, text = told(*copies)
    assert code == 0
    assert row(text, "verdict") == ["FAIL", "FAIL"]
    assert row(text, "collisions") == ["1", "0"]
    assert re.search(r"\(until \d+\.\d s\)", text)
    assert re.search(r"law=safe is partial: .*none \(the run was killed", text)


def test_a_report_of_the_first_schema_is_judged_again(told, copies):
    report = copies[0] / "report.json"
    old = json.loads(report.read_text()) | {"schema": 1}
    del old["fleet"]
    report.write_text(json.dumps(old))
    _, text = told(*copies)
    assert len(row(text, "last arrival")) == 2
    assert row(text, "control effort")[0] != NONE


def test_runs_of_different_scenarios_are_told_and_not_ranked(told, laws, copies):
    scenario = copies[0] / "scenario.yaml"
    scenario.write_text(scenario.read_text().replace("name: meeting", "name: other", 1))
    code, text = told(copies[0], laws[1])
    assert code == 0
    assert "different scenarios: other, meeting" in text
    assert "★" not in text


def test_many_runs_stand_below_one_another(told, fly, laws):
    runs = [fly(f"seed={seed}") for seed in range(1, 7)]
    code, text = told(*runs)
    assert code == 0
    assert re.findall(r"^(seed=\d) +(?:PASS|FAIL)", text, re.M) == [
        f"seed={k}" for k in range(1, 7)
    ]
    assert row(text, "seed  ") == ["1, 2, 3, 4, 5, 6"]


def test_every_run_of_few_has_its_own_colour_and_its_own_dashes():
    looks = [look(place, 4) for place in range(4)]
    assert len({one.colour for one in looks}) == len({one.dashes for one in looks}) == 4
    assert len({look(place, 24)[:2] for place in range(24)}) == 24


def test_what_cannot_be_compared_is_refused(laws, tmp_path):
    def refused(*folders):
        with pytest.raises(MavherdError) as caught:
            line_up(folders)
        return str(caught.value)

    assert "needs two runs or more" in refused(laws[0])
    again = laws[0] / "../" / laws[0].name
    assert f"this run is given twice (first as {laws[0]})" in refused(*laws, again)
    assert "25 runs are too many" in refused(*(tmp_path / str(k) for k in range(25)))
    assert "there is no such folder" in refused(laws[0], tmp_path / "nowhere")


def test_a_place_that_cannot_be_written_to_is_named(laws, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["compare", *map(str, laws), "-o", str(tmp_path / "file")]) == 2
    assert f"{tmp_path / 'file'}: cannot write there: File exists" in capsys.readouterr().err


def test_what_is_in_a_folder_is_not_overwritten_unasked(laws, copies, tmp_path, capsys):
    def compare(folder, *options):
        code = main(["compare", *map(str, laws), "-o", str(folder), *options])
        return code, capsys.readouterr().err

    before = sorted(copies[0].rglob("*"))
    code, said = compare(copies[0], "--force")
    assert (code, "this is the folder of a run" in said) == (2, True)
    code, said = compare(copies[0] / "vehicles", "--force")
    assert (code, "files that are no comparison's" in said) == (2, True)
    assert sorted(copies[0].rglob("*")) == before
    done = tmp_path / "done"
    done.mkdir()
    (done / "compare.json").write_text("mine")
    code, said = compare(done)
    assert (code, "--force replaces it" in said) == (2, True)
    assert (done / "compare.json").read_text() == "mine"
    assert compare(done, "--force")[0] == 0
    assert json.loads((done / "compare.json").read_text())["schema"] == 1


def test_runs_may_stand_behind_an_option(laws, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["compare", str(laws[0]), "--json", str(laws[1]), "-o", str(out)]) == 0
    assert len(json.loads(capsys.readouterr().out)["runs"]) == 2
    with pytest.raises(SystemExit):
        main(["compare", str(laws[0]), "--jsn", str(laws[1])])
    assert "unrecognized arguments" in capsys.readouterr().err


def test_ctrl_c_while_it_records_leaves_no_half_a_file(laws, tmp_path, monkeypatch):
    comparison = pytest.importorskip("mavherd.gcs.recording.comparison")

    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(comparison, "_numbers", interrupt)
    with pytest.raises(KeyboardInterrupt):
        compare_module.compare(line_up(laws), tmp_path / "out", lambda _: None)
    assert (tmp_path / "out/compare.html").exists()
    assert not list((tmp_path / "out").glob("compare.rrd*"))


def test_the_commands_of_the_page_can_be_given_anywhere(laws, tmp_path, monkeypatch):
    monkeypatch.chdir(laws[0].parent)
    out = tmp_path / "out"
    assert main(["compare", *(run.name for run in laws), "-o", str(out)]) == 0
    page = (out / "compare.html").read_text()
    assert f"mavherd compare {laws[0]} {laws[1]}\nmavherd diff {laws[0]} {laws[1]}" in page
    assert f"mavherd view {out / 'compare.rrd'}" in page


@pytest.mark.parametrize("columns", [40, 60, 80])
def test_no_word_is_broken_at_a_narrow_terminal(fly, laws, columns):
    found = line_up([*laws, fly("team.law=safe", "origin.lat=47.397742123456")])
    console = Console(width=columns, file=StringIO())
    console.print(comparison(found, standings([run.report for run in found.runs]), console))
    text = console.file.getvalue()
    for word in ("47.397742123456", "law=off", "verdict", "collisions"):
        assert word in text, text


def test_without_the_view_extra_there_is_the_table_and_one_line(laws, tmp_path, monkeypatch):
    monkeypatch.setattr(compare_module, "find_spec", lambda name: None)
    written = compare_module.compare(line_up(laws), tmp_path / "out", lambda _: None)
    assert [path.name for path in written.files] == ["compare.html"]
    (note,) = written.notes
    assert note.startswith("matplotlib is missing, so no figures; rerun-sdk is missing")
    assert "pip install 'mavherd[view]'" in note
    assert "mavherd view" not in (tmp_path / "out/compare.html").read_text()
    assert "<figure>" not in (tmp_path / "out/compare.html").read_text()
