"""`mavherd sweep` on the command line: what is refused before anything runs, and how it ends."""

import argparse
import json
import os
import re
import signal
from pathlib import Path

import pytest

from mavherd.gcs.cli import main
from mavherd.gcs.commands import sweep as sweep_command
from mavherd.gcs.sweep import folder as folders
from mavherd.gcs.sweep.columns import columns

PAGE = (Path(__file__).parents[3] / "docs" / "sweeps.md").read_text(encoding="utf-8")


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def refused(capsys, here):
    """Return the one line with which a command line is refused."""

    def run(*words):
        before = sorted(here.rglob("*"))
        try:
            code = main(["sweep", *map(str, words)])
        except SystemExit as end:  # argparse
            code = end.code
        assert code == 2
        out, err = capsys.readouterr()
        (line,) = (line for line in err.splitlines() if line.startswith("mavherd: "))
        assert out == ""
        assert sorted(here.rglob("*")) == before, "something was left behind"
        return line

    return run


def sweep(*words):
    return main(["sweep", *map(str, words)])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "no scenario is given"),
        (("crossing",), "no shipped scenario has this name (did you mean 'crossing-targets'?"),
        (("none.yaml",), "none.yaml: cannot read this file"),
        (("one-rover", "--jobs", "0"), "--jobs 0: expected 1..256"),
        (("one-rover", "--jobs", "many"), "invalid int value: 'many'"),
        (("one-rover", "--seeds", "5:2"), "5:2 holds no seed"),
        (("one-rover", "--seeds", ""), "'' is no seed"),
        (("one-rover", "--set", "team.law=off,sfae"), "unknown law 'sfae' (did you mean 'safe'?"),
        (("one-rover", "--set", "duration=10,ten"), "duration: must be a number"),
        (("one-rover", "--seeds", "0:2000000"), "at most 1,000,000 runs"),
        (("--resume", "nowhere"), "nowhere/sweep.json: No such file"),
        (("one-rover", "--resume", "x"), "goes on with a sweep as it is (leave out a scenario)"),
        (("--resume", "x", "--seeds", "1"), "leave out --seeds"),
        (("--resume", "x", "--set", "a=b"), "leave out --set"),
        (("--resume", "x", "--processes"), "leave out --processes"),
        (("--resume", "x", "--out", "y"), "not allowed with argument"),
    ],
)
def test_wrong_input_is_refused_before_anything_is_made(refused, words, said):
    assert said in refused(*words)


def test_without_pyarrow_one_line_says_what_to_install(refused, monkeypatch):
    monkeypatch.setattr(sweep_command, "find_spec", lambda name: None)
    said = refused("one-rover")
    assert said.endswith("pyarrow, which is missing (pip install 'mavherd[view]')")


def test_a_file_as_folder_is_named(refused, here):
    (here / "taken").write_text("")
    assert "taken: cannot make this folder" in refused("one-rover", "--out", "taken")


def test_a_sweep_ends_with_a_summary_alone_on_stdout(here, dash, capsys):
    code = sweep(dash, "--seeds", "0:3", "--set", "team.law=off,safe", "--jobs", 2, "--json")
    out, err = capsys.readouterr()
    assert code == 0
    told = json.loads(out)
    (folder,) = Path("sweeps").iterdir()
    assert told == json.loads((folder / folders.SUMMARY).read_text())
    assert folder.name.startswith("dash-")
    assert (told["runs"], len(told["points"]), told["failed"]) == (6, 2, 0)
    assert f"sweep folder {folder}" in err


def test_ctrl_c_while_the_summary_is_made_ends_it(here, dash, capsys, monkeypatch):
    from mavherd.gcs.sweep import figures

    def interrupted(folder, summary):
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(figures, "draw", interrupted)
    words = dash, "--seeds", "0:3", "--out", "out"
    assert sweep(*words) == 130
    how = "3 of 3 runs are done (go on with: mavherd sweep --resume out)"
    assert how in capsys.readouterr().err
    monkeypatch.undo()
    monkeypatch.chdir(here)
    assert sweep("--resume", "out") == 0
    assert Path("out", folders.FIGURES, "rates.png").exists()


def test_the_scenarios_own_seed_is_the_default(here, dash, capsys):
    assert sweep(dash, "--set", "seed=7") == 2
    dash.write_text(dash.read_text() + "seed: 41\n")
    assert sweep(dash, "--out", "out") == 0
    assert folders.read_plan(Path("out")).seeds == (41,)


def test_assertions_that_fail_and_time_outs_are_data(here, dash, capsys):
    options = "--set", "expect.min_separation_m=1,50", "--set", "duration=1,30"
    assert sweep(dash, *options, "--json") == 0
    points = json.loads(capsys.readouterr().out)["points"]
    passed = [point["rates"]["passed"]["hits"] for point in points]
    timed_out = [point["rates"]["timed_out"]["hits"] for point in points]
    assert (passed, timed_out) == ([0, 1, 0, 0], [1, 0, 1, 0])


def test_a_run_without_a_verdict_is_not(here, dash, capsys, monkeypatch):
    from mavherd.gcs.sweep import task

    real = task.in_process

    def fails(scenario):
        return real(scenario) if scenario.seed != 1 else {}["no such thing"]

    monkeypatch.setattr(task, "in_process", fails)
    assert sweep(dash, "--seeds", "0:3") == 3
    err = capsys.readouterr().err
    assert "failed, 1 run: KeyError: 'no such thing'" in err
    assert f"mavherd run {next(Path('sweeps').iterdir())}/scenario.yaml --seed 1\n" in err


def test_commands_name_the_folders_copy_of_a_file_and_a_shipped_scenario_by_its_name(
    here, dash, capsys
):
    assert sweep(dash, "--json", "--out", "o") == 0
    look = json.loads(capsys.readouterr().out)["worst"][0]
    assert look["command"] == "mavherd run o/scenario.yaml --seed 1"
    assert sweep("one-rover", "--set", "duration=1", "--seeds", "4", "--json") == 0
    look = json.loads(capsys.readouterr().out)["worst"][0]
    assert look["command"] == "mavherd run one-rover --seed 4 --set duration=1"


def test_the_same_sweep_in_its_folder_goes_on_and_another_is_refused(here, dash, capsys):
    words = dash, "--seeds", "0,1", "--out", "out"
    assert sweep(*words) == 0
    before = Path("out", folders.TABLE).stat()
    assert sweep(*words) == 0
    assert sweep("--resume", "out") == 0
    assert Path("out", folders.TABLE).stat().st_mtime_ns == before.st_mtime_ns
    capsys.readouterr()
    assert sweep(dash, "--seeds", "0,2", "--out", "out") == 2
    assert "--seeds is 0,2, not 0,1 (choose another folder" in capsys.readouterr().err
    assert sweep(*words, "--processes") == 2
    assert "mode is processes, not in-process" in capsys.readouterr().err


def test_a_sweep_goes_on_with_the_scenario_that_it_began_with(here, dash, capsys):
    assert sweep(dash, "--seeds", "0,1", "--out", "out") == 0
    dash.write_text("nonsense")
    assert sweep("--resume", "out") == 0
    copy = Path("out", folders.SCENARIO)
    copy.write_text(copy.read_text().replace("east: 1", "east: 2"))
    assert sweep("--resume", "out") == 2
    assert "is not what the sweep began with" in capsys.readouterr().err


def test_a_sweep_of_another_version_is_not_gone_on_with(here, dash, capsys):
    assert sweep(dash, "--out", "out") == 0
    plan = Path("out", folders.PLAN)
    tree = json.loads(plan.read_text())
    plan.write_text(json.dumps(tree | {"version": "0.0.1"}))
    assert sweep("--resume", "out") == 2
    assert "begun by mavherd 0.0.1" in capsys.readouterr().err


def test_the_pages_script_reads_a_table(here, dash, capsys):
    assert sweep(dash, "--set", "team.law=paper,safe", "--out", "sweeps/crossing") == 0
    (script,) = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    exec(script, {})
    assert "collisions_sum" in capsys.readouterr().out


def test_the_page_tells_every_option_and_no_other():
    parser = argparse.ArgumentParser(add_help=False)
    sweep_command.add_options(parser)
    known = {word for action in parser._actions for word in action.option_strings}
    assert set(re.findall(r"^\| `(--[a-z]+)`", PAGE, re.MULTILINE)) == known


def test_the_page_names_every_column_and_file(dash, planned):
    plan, points = planned()
    for column in columns(plan, points):
        name = re.sub(r"_r[12]_", "_<robot>_", column.name)
        assert f"`{name}`" in PAGE or "rover_rover" in name, name
    for name in ("PLAN", "SCENARIO", "STREAM", "TABLE", "SUMMARY"):
        assert f"`{getattr(folders, name)}`" in PAGE


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_a_signal_while_the_grid_is_checked_ends_it_before_it_begins(
    here, dash, capsys, monkeypatch, how
):
    from mavherd.gcs.sweep.terminal import SweepView

    monkeypatch.setattr(SweepView, "checked", lambda *_: os.kill(os.getpid(), how))
    assert sweep(dash, "--set", "duration=1,2,3", "--out", "out") == 130
    assert capsys.readouterr().err == "mavherd: interrupted\n"
    assert not Path("out").exists()
