"""Runs are named by as little as tells them apart."""

from pathlib import Path

from mavherd.gcs.compare.labels import differing, groups, labels

FOLDERS = [Path(f"/runs/x-20260101-120000-{tail}") for tail in ("aaaa", "bbbb", "cccc", "dddd")]


def run(name="x", law="safe", seed=1, **more):
    return {"name": name, "team.law": law, "seed": seed, **more}


def named(*runs):
    return labels(runs, FOLDERS[: len(runs)])


def test_what_differs_names_them():
    assert named(run(law="off"), run(law="safe")) == ["law=off", "law=safe"]
    assert named(run(seed=1), run(seed=2)) == ["seed=1", "seed=2"]
    told = named(run(law="off"), run(), run(law="off", seed=2), run(seed=2))
    assert told == ["law=off, seed=1", "law=safe, seed=1", "law=off, seed=2", "law=safe, seed=2"]


def test_no_more_than_is_needed_is_said():
    assert named(run(law="off", duration=5), run(duration=9)) == ["law=off", "law=safe"]
    other = run("y", **{"robots.quad1.kind": "quadcopter", "description": "Y"})
    assert named(run(description="X"), other) == ["x", "y"]


def test_a_key_that_a_run_does_not_have_is_its_default():
    key = {"robots.quad1.params.mass": 1.5}
    assert named(run(**key), run()) == ["mass=1.5", "mass=default"]


def test_keys_of_one_name_are_told_in_full():
    a = run(**{"robots.quad1.params.mass": 1, "robots.quad2.params.mass": 1})
    b = run(**{"robots.quad1.params.mass": 2, "robots.quad2.params.mass": 1})
    c = run(**{"robots.quad1.params.mass": 1, "robots.quad2.params.mass": 2})
    assert named(a, b, c)[1] == "robots.quad1.params.mass=2, robots.quad2.params.mass=1"


def test_runs_that_differ_in_nothing_are_told_apart_by_their_folders():
    assert named(run(), run()) == ["aaaa", "bbbb"]
    assert named(run(), run(), run(seed=2)) == ["seed=1 (aaaa)", "seed=1 (bbbb)", "seed=2"]
    copies = [Path("/a/run-aaaa"), Path("/b/run-aaaa")]
    assert labels([run(), run()], copies) == ["aaaa 1", "aaaa 2"]


def test_runs_that_take_many_keys_to_tell_apart_go_by_their_folders():
    keys = [f"robots.r{k}.start.east" for k in range(5)]
    runs = [run(**{key: int(key == mine) for key in keys}) for mine in keys]
    folders = [*FOLDERS, Path("/runs/x-20260101-120000-eeee")]
    assert labels(runs, folders) == [folder.name for folder in folders]


def test_what_matters_most_comes_first():
    a = run("x", "off", 1, **{"robots.a.kind": "rover", "duration": 1, "description": "A"})
    b = run("y", "safe", 2, **{"robots.a.kind": "quad", "duration": 2, "description": "B"})
    wanted = ["name", "team.law", "seed", "duration", "description", "robots.a.kind"]
    assert differing([a, b]) == wanted


def test_of_many_runs_what_matters_most_shares_a_colour():
    runs = [run(law=law, seed=seed) for law in ("off", "safe") for seed in range(10)]
    names = [f"run{k}" for k in range(20)]
    assert groups(runs, names) == ["law=off"] * 10 + ["law=safe"] * 10
    assert groups(runs[:4], names[:4]) == names[:4]
    seeds = [run(seed=seed) for seed in range(20)]
    assert groups(seeds, names) == names
