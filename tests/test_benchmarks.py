"""What the benchmarks print is right, and has its place in the docs; they measure by hand only."""

import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.fixture(autouse=True)
def _importable(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))


@pytest.mark.parametrize(
    ("measured", "compiled", "word"),
    [
        (0.0007, True, "reached"),
        (0.0012, True, "missed, 1.50 times"),
        (0.0012, False, "reached"),
        (None, True, "not measured"),
    ],
)
def test_a_target_is_reached_or_missed_by_a_factor(measured, compiled, word):
    targets = importlib.import_module("targets")
    (target,) = (t for t in targets.TARGETS if t.key == "quadcopter full")
    assert target.verdict(measured, compiled=compiled)[-1] == word


def test_a_factor_that_is_too_small_is_missed():
    targets = importlib.import_module("targets")
    (target,) = (t for t in targets.TARGETS if t.key == "factor 10")
    assert target.verdict(40.0, compiled=True) == (">= 80", "40.0", "missed, 2.00 times")
    assert target.verdict(81.0, compiled=True)[-1] == "reached"


def test_every_target_that_depends_on_a_size_is_measured_at_that_size():
    targets = importlib.import_module("targets")
    effort = importlib.import_module("sections").Effort()
    keys = [target.key.split() for target in targets.TARGETS]
    sizes = {int(words[1]) for words in keys if words[0] in ("factor", "cores", "late", "ready")}
    assert sizes <= set(effort.sizes)
    assert {int(words[1]) for words in keys if words[0] == "tick"} <= set(effort.teams)


@pytest.mark.parametrize(
    ("value", "text"), [(0.00123, "0.00123"), (1.5, "1.50"), (24.04, "24.0"), (412.3, "412")]
)
def test_three_digits_count(value, text):
    assert importlib.import_module("tables").digits(value) == text


@pytest.mark.parametrize(
    ("name", "part"),
    [
        ("performance.md", "compiled"),
        ("performance.md", "pure"),
        ("performance.md", "recording"),
        ("determinism.md", "proof"),
    ],
)
def test_a_table_replaces_the_one_before_and_nothing_else(tmp_path, name, part):
    page = importlib.import_module("page")
    path = tmp_path / name
    path.write_text((ROOT / "docs" / name).read_text(encoding="utf-8"), encoding="utf-8")
    page.write(path, part, "| a |\n")
    once = path.read_text()
    page.write(path, part, "| a |\n")
    assert path.read_text() == once
    assert f"<!-- begin {part} -->\n| a |\n<!-- end {part} -->\n" in once
    assert once.splitlines()[0] == (ROOT / "docs" / name).read_text().splitlines()[0]


def test_a_page_without_room_is_refused(tmp_path):
    path = tmp_path / "page.md"
    path.write_text("# Nothing\n")
    with pytest.raises(SystemExit, match="begin proof"):
        importlib.import_module("page").write(path, "proof", "")


def test_a_run_can_be_watched(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    flights = importlib.import_module("flights")
    # not at full speed: it lasts for several looks on any machine
    report, usage = flights.watch(flights.lone_scenario("rover", 20.0), speed=10.0)
    assert report["exit_code"] == 0
    assert usage.of("rover") > 0
    assert usage.of("coordinator") > 0
    assert usage.memory["rover"].pss > 1
