"""Whatever a file holds, the answer is a scenario or a ScenarioError of one line."""

from copy import deepcopy
from typing import Any

import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mavherd.scenarios.dump import scenario_to_yaml
from mavherd.scenarios.errors import ScenarioError
from mavherd.scenarios.loader import load_scenario

FULL: dict[str, Any] = {
    "name": "full",
    "description": "all keys",
    "duration": 60,
    "seed": 3,
    "origin": {"lat": 47, "lon": 8, "alt": 400},
    "team": {
        "law": "safe",
        "rate_hz": 20,
        "start_sigma_m": 0.1,
        "takeoff_up": 2,
        "setpoint_timeout_s": 0.5,
        "state_timeout_s": 1,
        "coordinators": "central",
        "autopilot": "px4",
        "ready_timeout_s": 60,
        "at_end": "hold",
        "law_params": {"k": 1},
    },
    "disturbance": {"form": "held", "amplitude": 0.4, "hold_s": 0.1},
    "robots": [
        {
            "name": "a",
            "kind": "rover",
            "system_id": 3,
            "start": {"east": 0, "north": 0, "heading_deg": 45},
            "rectangle": {
                "corner": {"east": 0, "north": 0},
                "width": 4,
                "height": 3,
                "speed": 0.5,
                "clockwise": True,
                "laps": 1,
            },
            "params": {"mass": 8, "v_max": 0.9},
        },
        {
            "kind": "quadcopter",
            "count": 2,
            "spacing": 2,
            "start": {"east": 9, "north": 0},
            "circle": {"centre": {"east": 9, "north": 9, "up": 2}, "radius": 2, "laps": 1.5},
            "disturbance": "white",
            "profile": "paper",
        },
        {
            "kind": "quadcopter",
            "name": "w",
            "start": {"east": -9, "north": 0},
            "waypoints": {"points": [{"east": 1, "north": 1}, {"east": 2, "north": 2}], "speed": 1},
            "dwell_s": 2,
            "then": "return",
        },
        {"name": "h", "kind": "quadcopter", "start": {"east": -9, "north": 9}, "hold": {"up": 2}},
        {
            "name": "g",
            "kind": "rover",
            "start": {"east": -9, "north": 19},
            "goto": {"east": 1, "north": 30},
            "autopilot": "generic",
            "max_speed": 0.5,
        },
        {
            "name": "x",
            "kind": "quadcopter",
            "start": {"east": -20, "north": 0},
            "connect": "udpin:127.0.0.1:14550",
            "autopilot": "auto",
        },
    ],
    "fence": {"east": [-30, 30], "north": [-30, 40.5], "up": 20},
    "expect": {
        "collisions": 0,
        "all_arrive_within_s": 30,
        "tracking_rmse_m": {"a": 0.1},
        "min_separation_m": 0.5,
    },
}

scalars = (
    st.none()
    | st.booleans()
    | st.integers(-10, 300)
    | st.integers()
    | st.floats()
    | st.floats(-5, 5)
    | st.text(max_size=8)
    | st.sampled_from(["off", "held", "rover", "quadcopter", "return", "a", "quad1", "1e400", "<<"])
    | st.sampled_from(["tcp:127.0.0.1:5760", "udpin:[::1]:1", "serial:/dev/x", "auto", "tcp:"])
)
values = st.recursive(
    scalars,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["east", "north", "up", "name", "kind"]) | st.text(max_size=4),
            inner,
            max_size=3,
        )
    ),
    max_leaves=6,
)


def places(tree: Any, here: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    items = (
        tree.items()
        if isinstance(tree, dict)
        else enumerate(tree)
        if isinstance(tree, list)
        else ()
    )
    return [here] * bool(here) + [p for key, value in items for p in places(value, (*here, key))]


PLACES = places(FULL)


def answer(path, overrides=()) -> None:
    try:
        scenario = load_scenario(path, overrides)
    except ScenarioError as error:
        complaint = str(error)
    else:
        path.write_text(scenario_to_yaml(scenario), encoding="utf-8")
        assert load_scenario(path) == scenario
        return
    assert complaint.isprintable()


def test_the_full_scenario_is_good(tmp_path):
    path = tmp_path / "full.yaml"
    path.write_text(yaml.safe_dump(FULL))
    assert len(load_scenario(path).robots) == 7


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.tuples(st.sampled_from(PLACES), values), min_size=1, max_size=2))
def test_any_value_in_any_place(tmp_path_factory, changes):
    tree = deepcopy(FULL)
    for place, value in changes:
        here = tree
        try:
            for key in place[:-1]:
                here = here[key]
            here[place[-1]] = value
        except (KeyError, IndexError, TypeError):
            continue  # the first change took this place away
    path = tmp_path_factory.getbasetemp() / "fuzz.yaml"
    path.write_text(yaml.safe_dump(tree, allow_unicode=False))
    answer(path)


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(PLACES), values, st.booleans())
def test_any_override(tmp_path_factory, place, value, deeper):
    path = tmp_path_factory.getbasetemp() / "override.yaml"
    path.write_text(yaml.safe_dump(FULL))
    flow = yaml.safe_dump(value, default_flow_style=True, width=10**6).removesuffix("...\n").strip()
    key = ".".join(map(str, place)) + (".more" if deeper else "")
    answer(path, [f"{key}={flow}"])


@settings(max_examples=200, deadline=None)
@given(
    st.text(alphabet="name: robots[]{}-&*!|>'\"#%@`,?\t\n<0.~e", max_size=60),
    st.binary(max_size=20),
)
def test_any_text_and_any_bytes(tmp_path_factory, text, tail):
    path = tmp_path_factory.getbasetemp() / "text.yaml"
    path.write_bytes(text.encode() + tail)
    answer(path)
    answer(path, [text])
