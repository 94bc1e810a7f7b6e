"""The index leaves out nobody who could matter: laws answer the same with it and without."""

from math import inf, nan
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.gcs.laws import LAWS, Command, Nominal, Peer, make_law, reach_of
from mavherd.gcs.laws.approach import HOLD_WITHIN
from mavherd.gcs.team.coordinator import Coordinator
from mavherd.gcs.team.neighbours import Neighbours
from mavherd.scenarios.schema import Circle, Point, RobotSpec, Scenario, Team
from mavherd.transport.wire import Phase, VehicleState

TIMEOUT = 1.0
INDEX = Neighbours(TIMEOUT)
KINDS = ("quadcopter", "rover")
LAW_NAMES = tuple(LAWS)

spread = st.floats(-15, 15) | st.sampled_from((0.0, 3.0, 1e300, -1e308, inf, nan))
speeds = st.floats(-2, 2) | st.sampled_from((0.0, inf, nan))
ages = st.floats(0, 2) | st.sampled_from((0.0, TIMEOUT, 1e9))
peers = st.builds(
    lambda kind, place, velocity, age, vertical: (kind, place, velocity, age, vertical),
    st.sampled_from(KINDS),
    st.tuples(spread, spread, st.floats(0, 3)),
    st.tuples(speeds, speeds, st.just(0.0)),
    ages,
    st.booleans(),
)


def crowd(rows):
    return [
        Peer(i, kind, place, velocity, 0.3, age, vertical and kind == "quadcopter", 0.0)
        for i, (kind, place, velocity, age, vertical) in enumerate(rows, 1)
    ]


def oldest(team):
    return max((p.age for p in team if p.age <= TIMEOUT), default=0.0)


def answers(law_name, team, delay=0.0, v_max=1.0):
    """What the law says to each of the team, knowing all, and knowing whom the index gives."""
    laws = {kind: make_law(law_name, kind=kind, v_max=v_max) for kind in KINDS}
    team = [peer._replace(delay=delay) for peer in team]
    reaches = [reach_of(laws[peer.kind], oldest(team), delay) for peer in team]
    found = INDEX.of(team, range(len(team)), reaches)
    nominal = Nominal((1.0, 2.0, 2.0), (0.2, -0.1, 0.0))
    for i, (me, near) in enumerate(zip(team, found, strict=True)):
        law = laws[me.kind]
        others = team[:i] + team[i + 1 :]
        yield repr(law(me, others, nominal)), repr(law(me, near, nominal))


@pytest.mark.parametrize("law", LAW_NAMES)
@given(rows=st.lists(peers, min_size=1, max_size=12), delay=st.sampled_from((0.0, 0.3, 5.0)))
def test_laws_answer_the_same_whether_they_see_all_or_those_within_reach(law, rows, delay):
    for all_known, near_known in answers(law, crowd(rows), delay):
        assert near_known == all_known


@pytest.mark.parametrize("law", LAW_NAMES)
@pytest.mark.parametrize("area", [1.0, 9.0, 36.0])
@pytest.mark.parametrize("silent", [0.0, 0.1])
def test_in_a_field_of_240_too(law, area, silent):
    random = Random(5)
    side = (240 * area) ** 0.5
    rows = [
        (
            random.choice(KINDS),
            (random.uniform(0, side), random.uniform(0, side), random.uniform(0, 2.5)),
            (random.gauss(0, 0.5), random.gauss(0, 0.5), 0.0),
            5.0 if random.random() < silent else random.choice((0.0, 0.05)),
            random.random() < 0.05,
        )
        for _ in range(240)
    ]
    said = list(answers(law, crowd(rows)))
    assert [near for _, near in said] == [known for known, _ in said]
    if law != "off":
        assert len({near for _, near in said}) > 10


def test_neighbours_come_in_the_order_of_the_team_and_without_oneself():
    team = crowd([("rover", (float(x), 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, False) for x in range(9)])
    found = INDEX.of(team, [4, 0], [2.0, 1.5])
    assert [[p.system_id for p in near] for near in found] == [[3, 4, 6, 7], [2]]


def test_an_infinite_reach_gets_everybody():
    places = [(0.0, 0.0), (1e5, 1e5), (nan, 0.0), (inf, 2.0), (1e200, 0.0)]
    team = crowd([("rover", (*p, 0.0), (0.0, 0.0, 0.0), 0.0, False) for p in places])
    assert [len(near) for near in INDEX.of(team, range(5), [inf] * 5)] == [4] * 5


def test_reach_is_short_while_nothing_lags_and_grows_with_lateness():
    law = make_law("safe", kind="rover", v_max=1.0)
    reaches = [reach_of(law, age, 0.0) for age in (0.0, 0.1, 0.5, TIMEOUT, 10.0)]
    assert HOLD_WITHIN <= reaches[0] < 4.0
    assert reaches == sorted(reaches)
    assert reaches[-1] == reaches[-2] < reach_of(law, TIMEOUT, 0.4)


def test_reach_is_never_shorter_than_where_one_holds_for_the_silent():
    law = make_law("safe", kind="rover", v_max=0.2, params={"range_m": 0.1})
    assert reach_of(law, 0.0, 0.0) == HOLD_WITHIN


def test_a_law_that_does_not_say_how_far_it_looks_is_told_of_everybody():
    seen = []

    def law(me, neighbours, nominal):
        seen.append(len(neighbours))
        return Command(velocity=(0.0, 0.0, 0.0))

    assert reach_of(law, 0.0, 0.0) == inf
    core = steered(40)
    for member in core.members.values():
        member.law = law
    tick(core)
    assert seen == [39] * 40


def test_a_coordinator_sends_the_same_bytes_with_an_index_as_without():
    sent = [tick(steered(60, index_from=limit)) for limit in (0, inf)]
    assert sent[0] == sent[1]
    assert len(set(sent[0].values())) == 60


def steered(count, **options):
    """A coordinator of so many robots in a dense field, all known and on their way."""
    robots = tuple(
        RobotSpec(
            name=f"r{i}",
            kind=KINDS[i % 2],
            system_id=i,
            start=Point(i % 8 * 2.0, i // 8 * 2.0),
            path=Circle(centre=Point(8, 8), radius=2.0 + i % 5),
        )
        for i in range(1, count + 1)
    )
    scenario = Scenario(name="field", robots=robots, team=Team())
    return Coordinator(scenario, tuple(spec.name for spec in robots), **options)


def tick(core):
    """What it sends when each vehicle is where it starts, armed and in GUIDED."""
    states = []
    for number, member in enumerate(core.members.values()):
        spec, status = member.spec, member.station.status
        status.heartbeat_at = status.heard_at = status.position_at = 1.0
        status.armed, status.custom_mode = True, {"quadcopter": 4, "rover": 15}[spec.kind]
        member.mission.phase = Phase.ACTIVE
        place = (spec.start.east, spec.start.north, 2.0 * (spec.kind == "quadcopter"))
        states.append(
            VehicleState(
                spec.name,
                spec.system_id,
                1,
                1.0 - 0.2 * (number % 4),
                place,
                (0.1, -0.2, 0.0),
                (1.0, 0.0, 0.0, 0.0),
                status.custom_mode,
                True,
                Phase.ACTIVE,
            )
        )
    return core.tick(1.0, states)
