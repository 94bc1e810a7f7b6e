"""docs/report.schema.json describes every key of report.json, with its unit, and no other."""

import json
from pathlib import Path

import jsonschema
import pytest

from mavherd.gcs.report.judge import judge
from mavherd.gcs.report.report import MAX_PAIRS, RunFacts, build_report
from mavherd.gcs.report.report import SCHEMA as VERSION
from mavherd.gcs.run.in_process import simulate
from mavherd.scenarios.loader import load_scenario
from mavherd.scenarios.schema import Goto, Point, RobotSpec, Scenario

SCHEMA = json.loads(
    (Path(__file__).parents[3] / "docs" / "report.schema.json").read_text(encoding="utf-8")
)
OPEN = {"ports"}  # whose keys are names
TWO = """
name: two
duration: {duration}
team: {{law: {law}, start_sigma_m: 0}}
robots:
  - {{name: r1, kind: rover, start: {{east: 0, north: 0}}, goto: {{east: 3, north: 0}}}}
  - {{name: r2, kind: rover, start: {{east: 3, north: 0.1}}, goto: {{east: 0, north: 0}}}}
  - {{name: q3, kind: quadcopter, start: {{east: 9, north: 9}}, hold: {{}}}}
expect: {{collisions: 0, all_arrive_within_s: 30, tracking_rmse_m: {{q3: 0.5}}}}
"""


def keys(schema, where=""):
    """Yield the name and the schema of every key, at any depth."""
    for name, each in schema.get("properties", {}).items():
        yield f"{where}{name}", each
        yield from keys(each, f"{where}{name}.")
        yield from keys(each.get("items", {}), f"{where}{name}[].")


def closed(schema):
    """Return the schema with no key allowed that it does not describe."""
    shut = dict(schema)
    if "properties" in schema:
        inner = schema["properties"].items()
        shut["properties"] = {k: v if k in OPEN else closed(v) for k, v in inner}
        shut["additionalProperties"] = False
    if "items" in schema:
        shut["items"] = closed(schema["items"])
    return shut


def check(report):
    jsonschema.validate(report, closed(SCHEMA), jsonschema.Draft202012Validator)


@pytest.fixture
def scenario(tmp_path):
    def make(law="safe", duration=30):
        file = tmp_path / "two.yaml"
        file.write_text(TWO.format(law=law, duration=duration))
        return load_scenario(file)

    return make


def test_it_is_a_schema_of_this_version():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["properties"]["schema"]["const"] == VERSION
    assert SCHEMA["properties"]["pairs"]["maxItems"] == MAX_PAIRS


def test_every_key_is_described_and_every_number_has_its_unit():
    known = dict(keys(SCHEMA))
    assert len(known) > 100
    assert [name for name, each in known.items() if not each["description"].endswith(".")] == []
    numbers = {name: each for name, each in known.items() if "number" in each.get("type", [])}
    assert [name for name, each in numbers.items() if not each.get("unit")] == []
    metres = {each["unit"] for name, each in numbers.items() if name.endswith("_m")}
    seconds = {each["unit"] for name, each in numbers.items() if name.endswith("e_s")}
    assert (metres, seconds) == ({"m"}, {"s"})


@pytest.mark.parametrize(
    ("law", "duration", "code"), [("safe", 60, 0), ("off", 60, 1), ("safe", 3, 4)]
)
def test_reports_that_passed_failed_and_timed_out_are_as_it_says(
    scenario, tmp_path, law, duration, code
):
    result = simulate(scenario(law, duration), keep=tmp_path / "runs")
    assert result.exit_code == code
    check(json.loads((result.folder / "report.json").read_text(encoding="utf-8")))
    robots = {robot["name"]: robot for robot in result.report["robots"]}
    assert robots["r1"]["control_effort_m2_s3"] > 0
    assert robots["r1"]["link"]["lost_frames"] == 0
    assert robots["q3"]["deadlock_s"] is None


def test_a_report_of_nothing_is_as_it_says():
    spec = RobotSpec(
        name="r", kind="rover", system_id=1, start=Point(0, 0), path=Goto(target=Point(4, 0))
    )
    nothing = Scenario(name="none", robots=(spec,))
    facts = RunFacts(
        run_id="x", seed=1, law="safe", lockstep=False, speed=1.0, duration_s=0.0, wall_s=0.0,
        real_time_factor=0.0, digest=None, error="none came up", exit_code=3, missing=("all",),
    )  # fmt: skip
    report = build_report(nothing, judge(nothing, (spec,), [], None, 0.0), facts)
    check(report)
    assert report["partial"]
    with pytest.raises(jsonschema.ValidationError):
        check(report | {"undocumented": 1})
    with pytest.raises(jsonschema.ValidationError):
        check({key: value for key, value in report.items() if key != "fleet"})
