"""The laws: what they have in common with physics, with one another and with the paper."""

from itertools import pairwise
from math import cos, dist, exp, hypot, inf, isfinite, nan, pi, radians, sin
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.gcs.laws import HOLD, LAWS, LawError, Nominal, Peer, make_law
from mavherd.gcs.laws.safe import CLIMB, SINK, own_pace
from mavherd.transport.errors import MavherdError

KINDS = ["rover", "quadcopter"]
V_MAX = {"rover": 1.0, "quadcopter": 1.5}
both_kinds = pytest.mark.parametrize("kind", KINDS)
seeds = st.integers(0, 10**6)


def law(name, kind, **params):
    return make_law(name, kind=kind, v_max=V_MAX[kind], params=params)


def at(east, north=0.0, up=0.0, *, kind="rover", system_id=2, **more):
    peer = Peer(system_id, kind, (east, north, up), (0.0, 0.0, 0.0), 0.0)
    return peer._replace(**more)


def scene(seed):
    """Make up a robot among others of both kinds, all within reach, and where it wants to go."""
    random = Random(seed)

    def somebody(system_id, age):
        return Peer(
            system_id,
            random.choice(KINDS),
            (random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(0, 3)),
            (random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)),
            random.uniform(-pi, pi),
            age,
            random.random() < 0.2,
        )

    me = somebody(1, 0.0)
    others = [somebody(i, random.uniform(0, 0.9)) for i in range(2, random.randint(3, 8))]
    target = (random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(0, 3))
    return me, others, Nominal(target, (random.uniform(-1, 1), random.uniform(-1, 1), 0.1), 0.3)


def turned(v, angle, shift=(0.0, 0.0, 0.0)):
    c, s = cos(angle), sin(angle)
    return (c * v[0] - s * v[1] + shift[0], s * v[0] + c * v[1] + shift[1], v[2] + shift[2])


@pytest.mark.parametrize("name", LAWS)
@given(seed=seeds, angle=st.integers(-180, 180).map(radians))
def test_the_command_turns_and_moves_with_the_scene(name, seed, angle):
    me, others, nominal = scene(seed)
    shift = (30.0, -20.0, 5.0)

    def elsewhere(p):
        return p._replace(
            position=turned(p.position, angle, shift),
            velocity=turned(p.velocity, angle),
            heading=p.heading + angle,
        )

    here = law(name, me.kind)(me, others, nominal)
    there = law(name, me.kind)(
        elsewhere(me),
        [elsewhere(p) for p in others],
        Nominal(
            turned(nominal.position, angle, shift), turned(nominal.velocity, angle), nominal.yaw
        ),
    )
    assert there.velocity == pytest.approx(turned(here.velocity, angle), abs=1e-6)
    assert there.feed_forward == pytest.approx(turned(here.feed_forward, angle), abs=1e-6)
    if here.position:
        assert there.position == pytest.approx(turned(here.position, angle, shift))
    if here.yaw_rate:
        assert there.yaw_rate == pytest.approx(here.yaw_rate, abs=1e-6)


@pytest.mark.parametrize("name", LAWS)
@given(seed=seeds)
def test_a_law_is_a_pure_function(name, seed):
    me, others, nominal = scene(seed)
    one = law(name, me.kind)
    one(*scene(seed + 1))
    assert one(me, others, nominal) == law(name, me.kind)(me, tuple(others), nominal)


@given(seed=seeds)
def test_a_safe_command_is_a_velocity_within_the_limits(seed):
    me, others, nominal = scene(seed)
    command = law("safe", me.kind)(me, others, nominal)
    assert command.position is command.acceleration is command.yaw_rate is None
    assert hypot(*command.velocity[:2]) <= V_MAX[me.kind] + 1e-12
    assert -SINK <= command.velocity[2] <= CLIMB
    assert command.yaw == (nominal.yaw if me.kind == "quadcopter" else None)
    assert command.velocity[2] == 0 or me.kind == "quadcopter"


numbers = st.floats(-1e9, 1e9) | st.sampled_from([0.0, -0.0, 5e-324, 1e-9, 1.0])
triples = st.tuples(numbers, numbers, numbers)
peers = st.builds(
    Peer,
    st.integers(1, 240),
    st.sampled_from(KINDS),
    triples,
    triples,
    st.floats(-10, 10),
    st.floats(0, 1),
    st.booleans(),
)


@pytest.mark.parametrize("name", LAWS)
@given(me=peers, others=st.lists(peers, max_size=5), target=triples, velocity=triples)
def test_finite_inputs_give_finite_commands(name, me, others, target, velocity):
    twin = me._replace(system_id=241)
    nominal = Nominal(target, velocity, 0.0)
    command = law(name, me.kind)(me, [*others, twin], nominal)
    assert command is not HOLD
    assert all(
        isfinite(v) for part in command if part for v in (part if type(part) is tuple else [part])
    )


@both_kinds
@pytest.mark.parametrize("name", ["paper", "safe"])
def test_far_neighbours_have_no_effect(name, kind):
    me, nominal = at(0.0, kind=kind, system_id=1), Nominal((5.0, 1.0, 0.0))
    alone = law(name, kind)(me, [], nominal)
    assert law(name, kind)(me, [at(10.0, kind=kind), at(0, -9.0, kind=kind)], nominal) == alone
    assert law(name, kind)(me, [at(1.2, kind=kind)], nominal) != alone


@both_kinds
@pytest.mark.parametrize("name", ["paper", "safe"])
def test_a_silent_robot_makes_those_near_it_hold_and_nobody_else(name, kind):
    nominal = Nominal((5.0, 0.0, 0.0))
    silent = at(2.9, kind="quadcopter", up=30.0, age=1.01)
    one = law(name, kind)
    assert one(at(0.0, kind=kind, system_id=1), [silent], nominal) == HOLD
    assert one(at(0.0, kind=kind, system_id=1), [silent._replace(age=0.99)], nominal) != HOLD
    far = at(-0.2, kind=kind, system_id=1)
    assert one(far, [silent], nominal) == one(far, [], nominal) != HOLD
    patient = make_law(name, kind=kind, v_max=1.0, state_timeout=5.0)
    assert patient(at(0.0, kind=kind, system_id=1), [silent], nominal) != HOLD


@both_kinds
@pytest.mark.parametrize("name", ["paper", "safe"])
def test_an_old_state_counts_as_where_the_robot_is_by_now(name, kind):
    me, nominal = at(0.0, kind=kind, system_id=1), Nominal((5.0, 0.0, 0.0))
    old = at(1.6, 0.3, kind=kind, velocity=(-0.5, 0.5, 0.2), age=0.4)
    now = at(1.4, 0.5, 0.08, kind=kind, velocity=(-0.5, 0.5, 0.2))
    got = law(name, kind)(me, [old], nominal)
    expected = law(name, kind)(me._replace(delay=0.4), [now], nominal)  # age is lag, too
    assert got.velocity == pytest.approx(expected.velocity)
    assert got.yaw_rate == pytest.approx(expected.yaw_rate)


@both_kinds
def test_commands_that_come_late_close_in_more_slowly(kind):
    me, nominal = at(0.0, kind=kind, system_id=1), Nominal((5.0, 0.0, 0.0))
    near = at(1.0 if kind == "quadcopter" else 1.4, kind=kind)
    speeds = [
        law("safe", kind)(me._replace(delay=delay), [near], nominal).velocity[0]
        for delay in (-1.0, 0.0, 0.2, 0.5, 9.0)
    ]
    assert speeds[0] == speeds[1] > speeds[2] > speeds[3] > speeds[4] > 0.0


@both_kinds
def test_off_passes_the_nominal_target_on_whoever_is_near(kind):
    nominal = Nominal((5.0, 1.0, 2.0), (0.3, 0.1, 0.0), 0.7)
    command = law("off", kind)(at(0.0, kind=kind), [at(0.5, kind=kind, age=9.0)], nominal)
    assert command[:2] == nominal[:2]
    assert command.yaw == nominal.yaw
    assert command.feed_forward == (0.0, 0.0, 0.0)


# --- safe -----------------------------------------------------------------------------------


@both_kinds
@given(system_id=st.integers(1, 240))
def test_alone_it_flies_straight_to_the_target_at_its_own_pace(kind, system_id):
    me = at(0.0, kind=kind, system_id=system_id)
    command = law("safe", kind)(me, [], Nominal((30.0, 40.0, 0.0)))
    pace = own_pace(system_id) * V_MAX[kind]
    assert 0.9 * V_MAX[kind] <= pace <= V_MAX[kind]
    assert command.velocity == pytest.approx((0.6 * pace, 0.8 * pace, 0.0))
    assert command.feed_forward == (0.0, 0.0, 0.0)


def test_near_its_target_it_moves_with_it():
    nominal = Nominal((0.1, 0.0, 0.0), (0.2, 0.3, 0.0))
    command = law("safe", "rover", k_rover=2.0)(at(0.0, system_id=1), [], nominal)
    assert command.velocity == pytest.approx((0.4, 0.3, 0.0))


def test_no_two_neighbouring_ids_have_one_pace():
    paces = [own_pace(i) for i in range(1, 30)]
    assert min(abs(a - b) for a, b in pairwise(paces)) > 0.01


@both_kinds
def test_what_comes_head_on_is_passed_on_the_right_by_both(kind):
    one = law("safe", kind)
    a, b = at(-1.0, kind=kind, system_id=1), at(1.0, kind=kind, system_id=2)
    mine = one(a, [b], Nominal((9.0, 0.0, 0.0))).velocity
    theirs = one(b, [a], Nominal((-9.0, 0.0, 0.0))).velocity
    assert mine[1] < 0 < theirs[1]
    assert mine[0] < own_pace(1) * V_MAX[kind]


@both_kinds
def test_at_rest_it_is_pushed_straight_away_and_never_aside(kind):
    command = law("safe", kind)(at(0, kind=kind), [at(0.9, kind=kind)], Nominal((0.0, 0.0, 0.0)))
    assert command.velocity[0] < 0
    assert command.velocity[1] == command.velocity[2] == 0
    assert command.feed_forward == command.velocity


@both_kinds
def test_the_push_grows_as_the_clearance_shrinks(kind):
    one, me = law("safe", kind), at(0.0, kind=kind, system_id=1)
    pushes = [
        hypot(*one(me, [at(0.6 + i / 50, kind=kind)], Nominal((0.0, 0.0, 0.0))).feed_forward)
        for i in range(100)
    ]
    assert pushes == sorted(pushes, reverse=True)


@pytest.mark.parametrize(("wanted", "limit"), [(9.0, CLIMB), (-9.0, -SINK), (0.2, 0.2)])
def test_height_is_held_by_the_vertical_velocity(wanted, limit):
    me = at(0, up=10.0, kind="quadcopter")
    nominal = Nominal((0.0, 0.0, 10.0 + wanted))
    assert law("safe", "quadcopter")(me, [], nominal).velocity[2] == pytest.approx(limit)


def test_vertical_motion_of_the_target_is_followed():
    nominal = Nominal((0.0, 0.0, 3.0), (0.0, 0.0, 0.4))
    me = at(0, up=3.0, kind="quadcopter")
    assert law("safe", "quadcopter")(me, [], nominal).velocity[2] == pytest.approx(0.4)


@both_kinds
def test_a_rover_and_a_low_or_landing_quadcopter_keep_off_each_other(kind):
    other = "quadcopter" if kind == "rover" else "rover"
    one, nominal = law("safe", kind), Nominal((5.0, 0.0, 0.0))

    def pushed(up, **more):
        quad_up = {"rover": 0.0, "quadcopter": up}
        me = at(0, up=quad_up[kind], kind=kind, system_id=1, **(more if kind != "rover" else {}))
        peer = at(1, up=quad_up[other], kind=other, **(more if kind == "rover" else {}))
        return one(me, [peer], nominal).feed_forward != (0.0, 0.0, 0.0)

    assert pushed(1.0)
    assert pushed(1.7)
    assert not pushed(2.0)
    assert pushed(4.0, vertical=True)


# --- paper ----------------------------------------------------------------------------------


def test_a_rover_under_eq_22_turns_left_and_brakes_for_what_is_ahead():
    d, nominal = 1.5, Nominal((9.0, 0.0, 0.0))
    command = law("paper", "rover")(at(0.0, system_id=1), [at(d)], nominal)
    turn = 3 * exp(-((d - 1) ** 2))
    assert command.yaw_rate == pytest.approx(turn)
    assert command.velocity == pytest.approx((turn / -4, 0.0, 0.0))
    assert command.position == nominal.position
    behind = law("paper", "rover")(at(0.0, system_id=1), [at(-d)], nominal)
    assert behind.yaw_rate == pytest.approx(-turn)


def test_the_forward_part_of_eq_22_lies_along_the_heading_and_adds_to_the_targets_velocity():
    me = at(0.0, system_id=1, heading=0.5)
    command = law("paper", "rover")(me, [at(1.5)], Nominal((9.0, 0.0, 0.0), (0.1, 0.2, 0.0)))
    added = (command.velocity[0] - 0.1, command.velocity[1] - 0.2, 0.0)
    assert added == pytest.approx(command.feed_forward)
    assert added[0] * sin(0.5) == pytest.approx(added[1] * cos(0.5))


def test_eq_22_is_silent_at_the_target():
    command = law("paper", "rover")(at(0.0, system_id=1), [at(1.0)], Nominal((0.0, 0.0, 0.0)))
    assert command.yaw_rate == 0
    assert command.velocity == pytest.approx((0.0, 0.0, 0.0))


def test_eq_23_pushes_a_quadcopter_straight_away_whatever_its_direction_of_travel():
    me, d = at(0.0, kind="quadcopter", system_id=1), 1.3
    for target in ((9.0, 0.0, 0.0), (0.0, 9.0, 0.0), (0.0, 0.0, 0.0)):
        command = law("paper", "quadcopter")(me, [at(0, d, kind="quadcopter")], Nominal(target))
        assert command.velocity == pytest.approx((0.0, -3 * exp(-((d - 1) ** 2)), 0.0))
        assert command.yaw_rate is None


def test_eq_23_is_silent_with_enough_height_between():
    me, nominal = at(0.0, kind="quadcopter", system_id=1), Nominal((9.0, 0.0, 0.0))
    command = law("paper", "quadcopter")(me, [at(1, up=1.1, kind="quadcopter")], nominal)
    assert command.feed_forward == (0.0, 0.0, 0.0)


@both_kinds
def test_the_papers_gains_scale_its_feed_forward(kind):
    me, nominal = at(0.0, kind=kind, system_id=1), Nominal((9.0, 0.0, 0.0))
    once = law("paper", kind)(me, [at(1.2, kind=kind)], nominal)
    twice = law("paper", kind, k_f=6.0, k_r=6.0)(me, [at(1.2, kind=kind)], nominal)
    assert dist(twice.feed_forward, (0, 0, 0)) == pytest.approx(2 * hypot(*once.feed_forward))


# --- the registry ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "params", "says"),
    [
        ("saef", {}, "did you mean 'safe'?"),
        ("zzz", {}, "off, paper, safe"),
        ("safe", {"kapa_rover": 1.0}, "did you mean 'kappa_rover'?"),
        ("safe", {"v_max": 1.0}, "unknown parameter 'v_max'"),
        ("safe", {"_approach": 1.0}, "unknown parameter"),
        ("off", {"k_r": 1.0}, "it has none"),
        ("safe", {"k_r": nan}, "k_r must be a finite number"),
        ("safe", {"k_r": "1"}, "k_r must be a finite number"),
        ("safe", {"k_r": True}, "k_r must be a finite number"),
        ("safe", {"k_rover": 0.0}, "k_rover must be positive"),
        ("safe", {"kappa_quad": -1.0}, "kappa_quad must be positive"),
        ("safe", {"k_t": -1.0}, "k_t must not be negative"),
        ("safe", {"c0": -0.1}, "c0 must not be negative"),
        ("paper", {"k_v": 0.0}, "k_v must not be zero"),
    ],
)
def test_what_cannot_be_used_is_refused_with_the_cure(name, params, says):
    with pytest.raises(LawError, match=says.replace("?", r"\?")) as refused:
        make_law(name, kind="rover", v_max=1.0, params=params)
    assert isinstance(refused.value, MavherdError)


@pytest.mark.parametrize("bad", [0.0, -1.0, nan, inf])
def test_speed_and_timeout_must_be_positive(bad):
    with pytest.raises(LawError, match="v_max"):
        make_law("off", kind="rover", v_max=bad)
    with pytest.raises(LawError, match="state_timeout"):
        make_law("off", kind="rover", v_max=1.0, state_timeout=bad)


def test_a_kind_that_does_not_exist_is_a_programming_error():
    with pytest.raises(ValueError, match="boat"):
        make_law("off", kind="boat", v_max=1.0)
