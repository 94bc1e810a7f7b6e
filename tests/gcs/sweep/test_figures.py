"""Figures show the rates and medians that the summary has."""

import pytest

from mavherd.gcs.sweep import figures
from mavherd.gcs.sweep.figures import draw
from mavherd.gcs.sweep.summary import Summary

ROW = {
    "passed": True,
    "exit_code": 0,
    "collisions": 0,
    "all_arrived": True,
    "min_separation_rover_rover_m": 1.0,
}


@pytest.fixture
def drawn(planned, table_of, tmp_path, monkeypatch):
    """Draw a sweep; return its figures by name: drawn(rows, law=...)."""

    def make(rows_of, **grid):
        plan, points = planned(seeds=tuple(range(8)), **grid)
        rows = [rows_of(plan.settings(plan.job(k).point), plan.job(k)) for k in range(plan.runs)]
        summary = Summary(plan, points, table_of(plan, points, rows))
        made = {}

        def save(path, figure):
            made[path.stem] = figure
            return real(path, figure)

        real = figures.save
        monkeypatch.setattr(figures, "save", save)
        paths = draw(tmp_path / "figures", summary)
        assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)
        return made

    return make


def labels(axes):
    return [label.get_text() for label in axes.get_yticklabels()]


def test_words_make_a_row_for_each_grid_point(drawn):
    def row(settings, job):
        return ROW | {"collisions": int(settings["team.law"] == "off" and job.seed < 6)}

    made = drawn(row, law=("off", "paper", "safe"))
    collided = made["rates"].axes[1]
    assert labels(collided) == ["law off", "law paper", "law safe"]
    dots = [line.get_xdata()[0] for line in collided.lines if line.get_marker() == "o"]
    assert dots == [0.75, 0.0, 0.0]


def test_runs_are_dots_around_their_median(drawn):
    made = drawn(lambda _, job: ROW | {"min_separation_rover_rover_m": 1.0 + job.seed})
    axes = made["distributions"].axes[0]
    dots = next(line for line in axes.lines if line.get_marker() == ".")
    assert sorted(dots.get_xdata()) == [1.0 + seed for seed in range(8)]
    tick = next(line for line in axes.lines if line.get_marker() == "|")
    assert list(tick.get_xdata()) == [4.5]


def test_numbers_make_lines_over_their_axis(drawn):
    def row(settings, job):
        hit = settings["team.law"] == "off" and float(settings["team.rate_hz"]) <= job.seed * 5
        return ROW | {"collisions": int(hit)}

    made = drawn(row, rate_hz=("20", "5", "10"), law=("safe", "off"))
    collided = made["rates"].axes[1]
    lines = {line.get_label(): line for line in collided.lines}
    assert set(lines) == {"law safe", "law off"}
    assert list(lines["law off"].get_xdata()) == [5.0, 10.0, 20.0]
    assert list(lines["law off"].get_ydata()) == [7 / 8, 6 / 8, 4 / 8]


@pytest.mark.parametrize(
    ("lines", "said"), [(8, ""), (9, "the first 8 of 9 lines; the summary has all")]
)
def test_lines_that_have_no_colour_left_are_said_to_be_missing(drawn, lines, said):
    rates = ("4", "5", "6.25", "10", "12.5", "20", "25", "50", "100")[:lines]
    longer = tuple(f"0.{k}" for k in range(len(rates) + 1))
    made = drawn(lambda *_: ROW, rate_hz=rates, start_sigma_m=longer)
    for picture in made.values():
        assert len(picture.axes[0].get_legend().get_texts()) == 8
        assert picture.axes[0].get_title(loc="right") == said


def test_the_contact_distance_is_marked_where_it_matters(drawn):
    near = drawn(lambda *_: ROW)["distributions"].axes[0]
    far = drawn(lambda *_: ROW | {"min_separation_rover_rover_m": 9.0})["distributions"].axes[0]
    assert [line.get_xdata()[0] for line in near.lines if line.get_linestyle() == "--"] == [0.79]
    assert not [line for line in far.lines if line.get_linestyle() == "--"]


def test_nothing_measured_leaves_one_picture(drawn):
    made = drawn(lambda *_: {"passed": False, "exit_code": 3, "error": "x"}, law=("off", "safe"))
    assert set(made) == {"rates"}


def test_what_never_happened_is_said(drawn):
    made = drawn(lambda _, job: ROW | {"last_arrival_s": 9.0 if job.seed else None})
    axes = made["distributions"].axes[1]
    assert "never: 1 " in [text.get_text() for text in axes.texts]
