"""The page is one valid file for every reader: with a script or without, on paper, in the dark."""

import re
from html.parser import HTMLParser
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from mavherd.gcs.report.figures import draw
from mavherd.gcs.report.judge import judge
from mavherd.gcs.report.page import page
from mavherd.gcs.report.page_parts import table
from mavherd.gcs.report.page_separation import collisions, separations
from mavherd.gcs.report.page_style import COLOURS, HEAT, STYLE
from mavherd.gcs.report.report import RunFacts, build_report
from mavherd.gcs.report.truth import Track
from mavherd.scenarios.schema import Expect, Goto, Point, RobotSpec, Scenario

VOID = {"meta", "br", "img"}


def straight(name, system_id, start, goal, seconds=6.0):
    """Return a rover's track from `start` to `goal`."""
    time = np.arange(round(seconds * 100) + 1) / 100
    way = np.array(start) + np.outer(time / seconds, np.subtract(goal, start))
    position = np.column_stack([way, np.zeros_like(time)])
    velocity = np.gradient(position, 0.01, axis=0)
    turn, none = np.tile([1.0, 0, 0, 0], (len(time), 1)), np.zeros((len(time), 0))
    rates = np.zeros_like(position)
    return Track(name, "rover", system_id, (), time, position, velocity, turn, rates, none, ())


def team(count):
    """Return scenario, starts, tracks and verdict of rovers that meet in the middle, one by one."""
    specs, tracks = [], []
    for i in range(count):
        angle = 2 * np.pi * i / count
        start = np.array([np.cos(angle), np.sin(angle)]) * (2 + count / 3)
        tracks.append(straight(f"r{i}", i + 1, start, -start * (1 - i % 3 / 4)))
        goal = Goto(target=Point(*(-start).tolist()))
        place = Point(*start.tolist())
        specs.append(RobotSpec(name=f"r{i}", kind="rover", system_id=i + 1, start=place, path=goal))
    scenario = Scenario(name="meeting", robots=tuple(specs), expect=Expect(collisions=0))
    return scenario, specs, tracks, judge(scenario, tuple(specs), tracks, 0.5, 6.0)


def report_of(run, **changes):
    facts = RunFacts(
        run_id="meeting-1",
        seed=7,
        law="off",
        lockstep=True,
        speed=None,
        duration_s=6.0,
        wall_s=1.0,
        real_time_factor=6.0,
        digest="ab" * 32,
    )
    return build_report(run[0], run[3], facts) | changes


@pytest.fixture(scope="module")
def run():
    return team(6)


@pytest.fixture(scope="module")
def pictures(run, tmp_path_factory):
    return draw(tmp_path_factory.mktemp("figures"), *run)


class Reader(HTMLParser):
    """Checks that tags nest, and keeps what the tests ask for."""

    def __init__(self, html):
        super().__init__()
        self.open, self.tags, self.text = [], [], ""
        self.feed(html)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data

    def all(self, *names):
        return [attrs for tag, attrs in self.tags if tag in names]


def test_the_page_is_one_file_without_script_that_links_only_within_itself(run, pictures):
    html = page(report_of(run), pictures)
    reader = Reader(html)
    ids = [attrs["id"] for _, attrs in reader.tags if attrs.get("id")]
    assert len(ids) == len(set(ids))
    for _, attrs in reader.tags:
        for name in ("src", "href", "xlink:href", "action", "srcset"):
            link = attrs.get(name, "data:")
            assert link.startswith("data:") or link[1:] in ids
        assert not any(name.startswith("on") for name in attrs)
    assert set(re.findall(r"url\(#([^)]*)\)", html)) <= set(ids)
    assert not reader.all("script", "link", "iframe", "object")
    assert "@import" not in html
    assert "http" not in re.sub(r"<style>.*?</style>", "", html, flags=re.DOTALL)
    assert len(html.encode()) < 600_000


def test_readers_who_do_not_see_it_find_their_way(run, pictures):
    reader = Reader(page(report_of(run), pictures))
    levels = [int(tag[1]) for tag, _ in reader.tags if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(b - a <= 1 for a, b in pairwise(levels))
    assert all(attrs.get("scope") in ("col", "row") for attrs in reader.all("th"))
    assert len(reader.all("table")) == len(reader.all("caption"))
    assert all(attrs["alt"] for attrs in reader.all("img"))
    drawn = reader.all("svg")
    assert len(drawn) == len(pictures)
    assert all(attrs["role"] == "img" and attrs["aria-label"] for attrs in drawn)
    assert reader.all("html")[0]["lang"] == "en"
    for name in ("main", "header", "footer", "nav"):
        assert len(reader.all(name)) == 1
    labels = [attrs["aria-label"] for attrs in reader.all("section", "nav")]
    assert len(labels) == len(set(labels))


def test_every_colour_of_the_page_is_there_in_light_and_dark_and_print_is_light(run, pictures):
    html = page(report_of(run), pictures)
    light = re.search(r":root \{ color-scheme: light dark; (.*?) \}", html)[1]
    dark = re.search(r"screen and \(prefers-color-scheme: dark\) \{ :root \{ (.*?) \}", html)[1]
    names = set(re.findall(r"var\(--(\w+)\)", html))
    assert {"page", "text", "blue", "vermilion", "grid"} <= names
    for theme in (light, dark):
        assert names <= set(re.findall(r"--(\w+):", theme))
    assert "@media print" in html
    drawn = "".join(re.findall(r"<svg.*?</svg>", html, flags=re.DOTALL))
    assert re.findall(r"#[0-9a-f]{6}\b", drawn) == []


def contrast(one, other):
    """Return the contrast of two colours as WCAG 2 defines it."""

    def luminance(colour):
        digits = colour[1:] if len(colour) == 7 else "".join(c + c for c in colour[1:])
        rgb = np.array(list(bytes.fromhex(digits))) / 255
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        return linear @ (0.2126, 0.7152, 0.0722) + 0.05

    return max(luminance(one) / luminance(other), luminance(other) / luminance(one))


@pytest.mark.parametrize(("theme", "column"), [("light", 0), ("dark", 1)])
def test_text_can_be_read_on_what_is_behind_it(theme, column):
    colour = {name: pair[column] for name, pair in COLOURS.items()}
    for text in ("text", "soft", "good", "bad", "link"):
        for behind in ("page", "card"):
            assert contrast(colour[text], colour[behind]) >= 4.5
    for behind, text in map(str.split, HEAT[theme]):
        assert contrast(text, behind) >= 4.5


def test_names_and_texts_cannot_become_markup(run, pictures):
    evil = "</title><script>alert('1')</script>&amp;\"><img src=x>"
    report = report_of(run, scenario=evil, description=evil, error=evil, law=evil, run_id=evil)
    report["missing"], report["partial"] = [evil], True
    report["assertions"] = [dict(report["assertions"][0], text=evil)]
    for robot in report["robots"]:
        robot |= {"name": evil + robot["name"], "nearest": evil}
    for pair in [*report["pairs"], *report["collision_events"], *report["classes"]]:
        pair["robots"] = [evil + name for name in pair["robots"]]
    for key in ("version", "compiled", "python", "platform", "digest", "started_at"):
        report[key] = evil
    html = page(report, [])
    reader = Reader(html)
    assert not reader.all("script", "img")
    assert reader.text.count("alert('1')") > 10


def test_the_verdict_comes_first_then_numbers_figures_and_how_to_run_it_again(run, pictures):
    reader = Reader(page(report_of(run), pictures))
    wanted = ("Failed", "no collision:", "Numbers", "Separation", "Collisions", "Robots", "Figures")
    places = [reader.text.index(text, 2500) for text in (*wanted, "Run it again")]
    assert "mavherd run scenario.yaml --seed 7\n" in reader.text
    order = sorted(places)
    assert places[:2] == order[:2]
    assert places[-1] == order[-1]


def test_a_pair_that_touched_is_marked_in_both_its_cells_and_not_by_colour_alone(run):
    report = report_of(run)
    touched = {frozenset(c["robots"]) for c in report["collision_events"]}
    assert touched
    html = page(report, [])
    assert html.count('<td class="heat0">✕&nbsp;') == 2 * len(touched)
    assert '<table class="matrix">' in html
    row = html[html.index('<th scope="row">r0</th>') :]
    assert row.split("</tr>")[0].count("<td") == 6


def test_a_large_team_lists_its_nearest_pairs_and_stays_small(tmp_path):
    big = team(60)
    html = page(report_of(big), draw(tmp_path, *big))
    assert '<table class="matrix">' not in html
    assert "The 30 nearest of 1770 pairs" in html
    assert len(html.encode()) < 2_000_000


def test_what_is_missing_and_who_took_part_is_said_before_the_assertions(run):
    report = report_of(run, partial=True, missing=["run.rrd: the recorder died"], outside_clients=2)
    text = Reader(page(report, [])).text
    for reason in ("Partial", "run.rrd: the recorder died", "2 outside clients took part"):
        assert text.index(reason) < text.index("no collision:")


def test_a_report_of_the_first_schema_is_still_a_page(run):
    report = report_of(run)
    new = ("fleet", "cpu", "missing", "started_at", "in_process")
    old = {key: value for key, value in report.items() if key not in new}
    keys = ("name", "kind", "system_id", "goal", "arrived", "arrival_s", "miss_m", "path_ratio")
    keys += ("tracking_rmse_m", "nearest", "nearest_separation_m", "source")
    old["robots"] = [{key: robot[key] for key in keys} for robot in report["robots"]]
    text = Reader(page(old, [])).text
    assert "✕ Failed" in text
    assert "Control effort" not in text  # nothing is known of it


def test_all_times_count_from_when_all_were_ready_as_those_of_the_figures_do(run):
    report = report_of(run)
    assert report["ready_at_s"] == 0.5
    for tables in (separations(report), collisions(report)):
        assert "; time since all were ready</caption>" in "\n".join(tables)
    hit = report["collision_events"][0]["time_s"]
    assert f'<td class="num">{hit - 0.5:.2f}</td>' in "\n".join(collisions(report))
    nearest = report["classes"][0]["time_s"]
    assert f'<td class="num">{nearest - 0.5:.1f}</td>' in "\n".join(separations(report))


PROMISE = "the second run has the same digest"
COMMAND = "mavherd run scenario.yaml --seed 7"


@pytest.mark.parametrize("code", [0, 1, 4])
def test_a_run_that_the_scenario_repeats_promises_its_digest(run, code):
    text = Reader(page(report_of(run, exit_code=code), [])).text
    assert PROMISE in text
    assert COMMAND in text


@pytest.mark.parametrize(
    "changes",
    [
        {"script": None},
        {"exit_code": 130, "error": "interrupted"},
        {"exit_code": 3, "error": "r1 died"},
        {"outside_clients": 1},
        {"outside_clients": None},
        {"lockstep": False, "digest": None},
    ],
)
def test_a_run_that_the_scenario_may_not_repeat_promises_nothing(run, changes):
    text = Reader(page(report_of(run, **changes), [])).text
    assert PROMISE not in text
    assert COMMAND in text


def test_a_run_that_a_script_steered_is_repeated_by_the_script(run):
    text = Reader(page(report_of(run, script=True), [])).text
    assert PROMISE not in text
    assert COMMAND not in text
    assert "run your script again" in text


def test_what_is_not_known_of_a_killed_run_is_not_made_up(run):
    unknown = ("speed", "wall_s", "real_time_factor", "late_ticks", "outside_clients", "script")
    report = report_of(run, ticks=270, error="the run was killed", exit_code=3)
    html = page(report | dict.fromkeys(unknown), [])
    assert "<dt>Real-time factor</dt><dd>&ndash;<small>lockstep</small></dd>" in html
    for text in ("as fast as it goes", "Late ticks", "of 270", "None"):
        assert text not in Reader(html).text


def test_what_a_broken_off_run_has_not_decided_is_neither_passed_nor_failed(run):
    still_open = {"name": "collisions", "passed": None, "text": "no collision: none by then"}
    changes = {"passed": False, "error": "killed", "exit_code": 3, "assertions": [still_open]}
    html = page(report_of(run, **changes), [])
    assert '<b class="soft">&ndash; open</b><span>no collision: none by then' in html
    text = Reader(html).text
    assert "✕ Broken off" in text
    assert "not yet" in text  # some robots are still on their way
    for word in ("✕ Failed", "✓ pass", "✕ FAIL"):
        assert word not in text


def test_what_is_to_be_known_of_the_figures_is_said_with_them(run):
    assert 'id="figures"' not in page(report_of(run), [])
    assert (
        "None: no robot has a track."
        in Reader(page(report_of(run), [], "None: no robot has a track.")).text
    )


def test_a_table_that_is_taller_than_its_box_says_so_but_not_on_paper():
    rows = [(f"r{k}",) for k in range(100)]
    tall, low = ("\n".join(table("Robots", ("robot",), rows[:n])) for n in (100, 6))
    assert '<caption>Robots<span class="scroll"> (100 rows: scroll)</span></caption>' in tall
    assert "scroll)" not in low
    assert ".scroll { display: none; }" in STYLE.split("@media print")[1]
