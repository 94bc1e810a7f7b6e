"""Bad scenarios are refused with one line that names the file, the line or key, and the cure."""

from itertools import pairwise
from pathlib import Path

import pytest

from mavherd.scenarios.errors import ScenarioError
from mavherd.scenarios.loader import load_scenario
from mavherd.scenarios.source import MAX_BYTES

GOOD = """\
    name: good
    duration: 60
    team: {law: safe}
    disturbance: off
    robots:
      - {name: rover1, kind: rover, start: {east: 0, north: 0}, goto: {east: 4, north: 4}}
      - {name: quad1, kind: quadcopter, start: {east: 5, north: 0}, params: {mass: 1.3},
         circle: {centre: {east: 5, north: 2, up: 2}, radius: 2}}
    expect: {collisions: 0, tracking_rmse_m: {quad1: 0.1}}
    """


def test_the_error_names_file_line_key_problem_and_cure(refused):
    text = GOOD.replace("kind: rover", "kind: rovr")
    assert refused(text) == (
        "team.yaml:6: robots[0].kind: unknown kind 'rovr' (did you mean 'rover'?)"
    )


def test_a_bad_override_is_named_instead_of_the_file(refused):
    assert refused(GOOD, "robots.quad1.kind=quadcoper") == (
        "--set robots.quad1.kind=quadcoper: robots[1].kind: unknown kind 'quadcoper' "
        "(did you mean 'quadcopter'?)"
    )


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        # unknown keys
        ("duraton=30", "unknown key 'duraton' (did you mean 'duration'?)"),
        ("team.lwa=off", "team: unknown key 'lwa' (did you mean 'law'?)"),
        (
            "robots.0.start.up=1",
            "robots[0].start: unknown key 'up' (keys: east, north, heading_deg)",
        ),
        ("robots.0.gotto={east: 1, north: 1}", "did you mean 'goto'?"),
        # wrong types
        ("robots=7", "robots: must be a list, got 7"),
        ("robots=[7]", "robots[0]: must be a mapping, got 7"),
        ("robots=[]", "robots: is empty"),
        ("duration=long", "duration: must be a number, got 'long'"),
        ("duration='60'", "must be a number, got '60' (remove the quotes)"),
        ("duration=true", "must be a number, got true"),
        ("seed=1.5", "seed: must be a whole number"),
        ("team=safe", "team: must be a mapping, got 'safe' (keys: law, rate_hz"),
        ("robots.0.name=12", "must be text, got 12 (put it in quotes)"),
        ("robots.0.goto=", "robots[0].goto: is missing (keys: east, north, up)"),
        ("robots.0.goto={east: 1}", "robots[0].goto.north: is missing"),
        ("robots.1.circle.clockwise=1", "must be true or false"),
        ("robots.0.start=[0, 0]", "must be a mapping, got a list"),
        # NaN, infinity, magnitudes
        ("duration=.nan", "duration: must be a finite number, got nan"),
        ("robots.0.start.east=.inf", "must be a finite number, got inf"),
        ("robots.0.goto.north=-.inf", "must be a finite number, got -inf"),
        ("robots.1.params.mass=.nan", "robots[1].params.mass: must be a finite number"),
        ("robots.0.start.east=1e999", "must be a finite number"),
        ("robots.0.start.east=10001", "must be -10000..10000, got 10001"),
        ("duration=86401", "must be 0.001..86400"),
        ("duration=0", "must be positive, got 0"),
        ("duration=-3", "must be positive, got -3"),
        ("seed=-1", "seed: must be 0.."),
        ("seed=99999999999999999999999", "must be a whole number"),
        ("origin.lat=91", "origin.lat: must be -89..89, got 91"),
        ("robots.1.circle.radius=0", "radius: must be positive"),
        ("robots.1.circle.radius=-2", "radius: must be positive"),
        ("robots.1.circle.centre.up=-2", "up: must be 0.3..10000"),
        ("robots.0.goto.up=2", "robots[0].goto.up: a rover has no height"),
        ("robots.0.dwell_s=-1", "dwell_s: must be 0..86400"),
        ("team.rate_hz=0.5", "rate_hz: must be 1..100"),
        ("team.rate_hz=30", "not a multiple of 10 ms (the nearest that fits is 33.3333)"),
        ("disturbance.amplitude=-1", "disturbance.amplitude: must be 0..1000"),
        ("disturbance=heldd", "disturbance: unknown disturbance 'heldd' (did you mean 'held'?)"),
        (
            "disturbance={form: wite}",
            "disturbance.form: unknown form 'wite' (did you mean 'white'?)",
        ),
        # parameters
        ("robots.1.params.mass=-1", "robots[1].params.mass: must be positive"),
        ("robots.1.params.mas=1", "unknown parameter of a quadcopter (did you mean 'mass'?)"),
        ("robots.1.params.mass=heavy", "robots[1].params.mass: must be a number, got 'heavy'"),
        (
            "robots.1.circle.speed=1.6",
            "robots[1].circle.speed: 1.6 m/s is more than this quadcopter",
        ),
        (
            "robots.1.params.v_max=0.4",
            "0.5 m/s is more than this quadcopter can do (its v_max is 0.4)",
        ),
        # identity
        ("robots.0.name=quad1", "robots[1].name: two robots named 'quad1'"),
        ("robots.0.name=a b", "'a b' is no name (1 to 16 of the letters"),
        ("robots.0.name=abcdefghijklmnopq", "is no name (1 to 16 of the letters"),
        ("robots.0.name=röver", "is no name"),
        ("robots.0.name=''", "'' is no name"),
        ("robots.0.system_id=241", "system_id: must be 1..240, got 241"),
        ("robots.0.system_id=0", "system_id: must be 1..240, got 0"),
        ("name=../../etc", "name: '../../etc' is no name"),
        ("team.law=no law", "team.law: 'no law' is no name of a law"),
        ("team.coordinators=centrl", "did you mean 'central'?"),
        ("robots.0.then=return", "robots[0].then: a rover stays where its path ends"),
        ("robots.0.then=retrun", "robots[0].then: unknown then 'retrun' (did you mean 'return'?)"),
        # paths
        ("robots.0.hold={}", "a second path beside 'hold'"),
        ("robots.0.spacing=3", "robots[0].count: is missing"),
        ("robots.1.count=0", "robots[1].count: must be 1..240, got 0"),
        ("robots.1.count=241", "robots[1].count: 241 is more than 240 robots (a MAVLink network"),
        # expectations
        ("expect.collisions=-1", "expect.collisions: must be 0..1000000"),
        ("expect.tracking_rmse_m.quda1=0.1", "no robot has this name (did you mean 'quad1'?)"),
        ("expect.tracking_rmse_m.quad1=0", "must be positive"),
        ('expect={tracking_rmse_m: {"\\ud800": 1}}', "is no name"),
        # overrides themselves
        ("law", "not of the form key=value (as in team.law=paper)"),
        ("=3", "not of the form key=value"),
        ("team..law=3", "not of the form key=value"),
        ("robots.quad9.dwell_s=1", "robots has no 'quad9' (did you mean 'quad1'?)"),
        ("robots.7=1", "robots has no '7' (there are: rover1, quad1)"),
        ("duration.long=1", "duration is 60, not a mapping"),
        ("duration.very.long=1", "60 has no 'very'"),
        ("team={law: safe", "--set team={law: safe: not YAML"),
    ],
)
def test_what_cannot_be_is_refused_with_its_cure(refused, change, complaint):
    text = refused(GOOD, change)
    assert complaint in text


def test_two_robots_with_one_system_id_are_named(refused):
    text = refused(GOOD, "robots.0.system_id=3", "robots.1.system_id=3")
    assert "robots[1].system_id: 3 is already that of 'rover1'" in text


def test_robots_starting_inside_one_another_are_both_named(refused):
    text = refused(GOOD.replace("east: 5, north: 0", "east: 0.5, north: 0"))
    assert text.startswith(
        "team.yaml:7: robots[1].start: 'rover1' and 'quad1' start inside one another"
    )


def test_starts_too_close_for_the_drawn_offsets_are_refused(refused, load):
    crowd = """\
        name: crowd
        robots: [{kind: rover, count: 30, spacing: 0.8, start: {east: 0, north: 0}}]
        """
    assert "move them apart, or lower team.start_sigma_m" in refused(crowd, "team.law=off")
    assert len(load(crowd, "team.start_sigma_m=0", "team.law=off").robots) == 30


def test_more_robots_than_mavlink_has_ids_are_refused(refused):
    text = """\
        name: crowd
        robots:
          - {kind: rover, count: 200, start: {east: 0, north: 0}}
          - {kind: quadcopter, count: 200, start: {east: 0, north: 50}}
        """
    complaint = refused(text)
    assert complaint.startswith("team.yaml:4: robots[1]: more than 240 robots")
    assert "255 system ids" in complaint
    assert "with its own --gcs-udp, --api-udp and --tcp" in complaint


@pytest.mark.parametrize(
    ("second", "accepted"),
    [
        ("{kind: rover, start: {east: 9, north: 0}, goto: {east: 5.4, north: 4}}", False),
        ("{kind: rover, start: {east: 9, north: 0}, goto: {east: 5.5, north: 4}}", True),
        ("{kind: quadcopter, start: {east: 9, north: 0}, goto: {east: 4, north: 4, up: 3}}", False),
        (
            "{kind: quadcopter, start: {east: 9, north: 0}, goto: {east: 4, north: 4, up: 3},"
            " then: return}",
            True,
        ),
        (
            "{kind: quadcopter, start: {east: 9, north: 0}, goto: {east: 4, north: 4, up: 0.8},"
            " then: return}",
            False,
        ),
        ("{kind: rover, start: {east: 4, north: 4.2}}", False),
    ],
)
def test_two_robots_sent_to_one_place_are_refused(load, refused, second, accepted):
    text = GOOD.replace("    expect:", f"      - {second}\n    expect:")
    if accepted:
        load(text)
    else:
        assert "'rover1' and '" in refused(text)
        assert "one another" in refused(text)


@pytest.mark.parametrize(("gap", "accepted"), [(0.5, False), (0.6, True)])
def test_quadcopters_may_hover_over_one_another_at_enough_height(load, refused, gap, accepted):
    text = f"""\
        name: tower
        robots:
          - {{kind: quadcopter, start: {{east: 0, north: 0}}, hold: {{up: 2}}, then: return}}
          - kind: quadcopter
            start: {{east: 3, north: 0}}
            hold: {{east: 0, north: 0, up: {2 + gap}}}
            then: return
        """
    if accepted:
        load(text)
    else:
        assert "robots[1].hold: 'quad1' and 'quad2' are sent too near one another" in refused(text)


def test_only_law_safe_needs_more_room_than_the_bodies(load, refused):
    text = GOOD.replace(
        "    expect:",
        "      - {kind: rover, start: {east: 9, north: 0}, goto: {east: 5, north: 4}}\n    expect:",
    )
    assert "law safe needs 1.5 m" in refused(text)
    load(text, "team.law=paper")


@pytest.mark.parametrize(
    ("points", "complaint"),
    [
        ("[]", "needs two different points"),
        ("[{east: 1, north: 1}, {east: 1, north: 1}]", "needs two different points"),
        ("[{east: 1, north: 1}, {east: 2, north: 1, up: 3}]", "give `up` to all"),
        ("[{east: 1, north: 1}, {east: 2, nroth: 1}]", "waypoints.points[1]: unknown key 'nroth'"),
        ("{east: 1, north: 1}", "points: must be a list, got a mapping"),
    ],
)
def test_waypoints_that_lead_nowhere_are_refused(refused, points, complaint):
    way = f"waypoints: {{points: {points}}}"
    text = f"{{name: w, robots: [{{kind: quadcopter, start: {{east: 0, north: 0}}, {way}}}]}}"
    assert complaint in refused(text)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "team.yaml: must be a mapping, got nothing"),
        ("# nothing\n", "must be a mapping, got nothing"),
        ("- 1\n- 2\n", "team.yaml:1: must be a mapping, got a list"),
        ("just words", "must be a mapping, got 'just words'"),
        ("name: x\n", "team.yaml:1: robots: is missing"),
        ("name: x\nname: y\n", "team.yaml:2: duplicate key 'name'"),
        ("name: x\nteam: {law: safe\n", "team.yaml:3:1: not YAML"),
        ("name: x\n\tteam: 3\n", "team.yaml:2:1: not YAML: found character '\\t'"),
        ("name: x: y\n", "team.yaml:1:8: not YAML: mapping values are not allowed here"),
        ("name: *nobody\n", "not YAML: found undefined alias 'nobody'"),
        ("name: x\n--- \nname: y\n", "keep what is before or after the '---'"),
        ("name: !!python/object:os.system x\n", "team.yaml:1: unknown tag"),
        ("name: !secret x\n", "team.yaml:1: unknown tag '!secret'"),
        ("name: x\n? [1, 2]\n: 3\n", "team.yaml:2: a key must be a word"),
        ("name: x\n<<: 3\n", "'<<' must name a mapping"),
        ("name: x\nseed: !!int x\n", "team.yaml:2: 'x' is not int"),
        ("name: a\x07b\n", "team.yaml:1: a character that YAML does not allow"),
        ('name: "a\\ud800b"\n', "must be printable text"),
        ("a: &a [*a]\n", "nested more than 16 deep"),
        ("[" * 5000, "nested more than 16 deep"),
        ("a: " + "[" * 20 + "]" * 20, "nested more than 16 deep"),
    ],
)
def test_text_that_is_no_scenario_is_refused_with_its_line(refused, text, complaint):
    assert complaint in refused(text)


def test_a_billion_laughs_stay_small(refused):
    names = "abcdefghij"
    laughs = ["a: &a [x, x, x, x, x, x, x, x, x, x]"]
    laughs += [f"{b}: &{b} [{', '.join([f'*{a}'] * 10)}]" for a, b in pairwise(names)]
    assert "values, aliases counted in full" in refused("\n".join(laughs))


def test_an_enormous_file_is_refused_unread(refused):
    assert f"longer than {MAX_BYTES} bytes" in refused("# ä\n" * (MAX_BYTES // 4))


@pytest.mark.parametrize(
    ("source", "complaint"),
    [
        ("nowhere/team.yaml", "nowhere/team.yaml: cannot read this file: No such file"),
        ("tracking.yaml", "(the shipped scenario is called 'tracking')"),
        ("./", "cannot read this file"),
        ("a\0b.yaml", "cannot read this file"),
        ("x" * 5000 + ".yaml", "cannot read this file"),
        ("trackin", "no shipped scenario has this name (did you mean 'tracking'?"),
        ("zzz", "shipped: circle-traffic, crossing-targets, one-quad, one-rover, tracking"),
        ("", "no shipped scenario has this name"),
    ],
)
def test_a_file_or_name_that_is_not_there_is_refused(tmp_path, monkeypatch, source, complaint):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(source)
    assert complaint in str(caught.value)


def test_bytes_that_are_no_text_are_refused(tmp_path):
    path = tmp_path / "binary.yaml"
    path.write_bytes(b"name: \xff\xfe\n")
    with pytest.raises(ScenarioError, match=r"binary\.yaml: not UTF-8 text \(byte 6\)"):
        load_scenario(Path(path))


def test_a_bad_seed_argument_is_named(load):
    with pytest.raises(ScenarioError, match=r"^--seed -1: seed: must be 0\.\."):
        load(GOOD, seed=-1)
