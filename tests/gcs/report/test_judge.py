"""The judge finds contact, arrival and tracking error from truth, exactly when they happen."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from mavherd.gcs.report.contact import align
from mavherd.gcs.report.judge import judge
from mavherd.scenarios.paths import path_duration, reference
from mavherd.scenarios.schema import (
    Circle,
    Expect,
    Goto,
    Hold,
    Point,
    RobotSpec,
    Scenario,
    Team,
    Waypoints,
)


def at(east, north=0.0, up=0.0):
    return lambda t: (east, north, up)


def robot(name, kind, system_id, path=None, **more):
    return RobotSpec(
        name=name,
        kind=kind,
        system_id=system_id,
        start=Point(0, 0),
        path=path or Hold(at=Point(0, 0)),
        **more,
    )


def verdict_on(tracks, *, specs=None, ready_at=0.0, ended_at=1e9, expect=None, broken_off=False):
    specs = specs or tuple(robot(t.name, t.kind, t.system_id) for t in tracks)
    scenario = Scenario(name="test", robots=specs, expect=expect or Expect())
    return judge(scenario, specs, tracks, ready_at, ended_at, broken_off=broken_off)


@pytest.mark.parametrize(
    ("kinds", "contact"),
    [
        (("rover", "rover"), 0.79),
        (("quadcopter", "quadcopter"), 0.40),
        (("rover", "quadcopter"), 0.595),
    ],
)
def test_robots_collide_when_their_circles_overlap_and_only_then(track, kinds, contact):
    for gap, expected in ((-0.001, 1), (0.001, 0)):
        a = track("a", kinds[0], 1, at(0, 0, 0.0), 1)
        b = track("b", kinds[1], 2, at(contact + gap, 0, 0.05), 1)
        verdict = verdict_on([a, b])
        assert len(verdict.collisions) == expected
        assert verdict.pairs[0].contact == pytest.approx(contact)


@pytest.mark.parametrize(
    ("kinds", "ups", "expected"),
    [
        (("rover", "quadcopter"), (0.0, 1.01), 0),  # over the rover's top
        (("rover", "quadcopter"), (0.0, 0.99), 1),
        (("quadcopter", "quadcopter"), (2.0, 2.21), 0),
        (("quadcopter", "quadcopter"), (2.0, 2.19), 1),
        (("rover", "quadcopter"), (0.3, 1.29), 1),  # a rover on higher ground
    ],
)
def test_robots_above_one_another_collide_only_when_they_share_a_height(
    track, kinds, ups, expected
):
    tracks = [track(f"r{i}", kind, i, at(0, 0, ups[i]), 1) for i, kind in enumerate(kinds)]
    assert len(verdict_on(tracks).collisions) == expected


def pass_by(*passes, width=0.5):
    """Come from 3 m away to `width` at each of the times."""

    def way(t):
        return np.min([np.hypot(t - p, width) for p in passes], axis=0), 0.0, 0.0

    return way


def test_each_pass_is_one_event_with_time_place_and_names(track):
    still, passing = at(0, 0, 0), pass_by(5.0, 12.0)
    tracks = [track("r1", "rover", 1, still), track("r2", "rover", 2, passing)]
    events = verdict_on(tracks).collisions
    assert len(events) == 2
    touch = np.sqrt(0.79**2 - 0.5**2)  # s before the nearest point, at 1 m/s
    assert [e.time for e in events] == pytest.approx([5 - touch, 12 - touch], abs=0.011)
    assert events[0].names == ("r1", "r2")
    assert events[0].pair_class == "rover-rover"
    assert events[0].position == pytest.approx((0.395, 0, 0), abs=0.01)


def test_a_contact_lasts_until_the_robots_are_a_decimetre_apart(track):
    def chatter(amplitude):
        return lambda t: (0.79 + amplitude * np.sin(2 * np.pi * t - 0.1), 0.0, 0.0)

    still = track("r1", "rover", 1, at(0))
    assert len(verdict_on([still, track("r2", "rover", 2, chatter(0.09))]).collisions) == 1
    assert len(verdict_on([still, track("r2", "rover", 2, chatter(0.11))]).collisions) == 20 + 1


def test_the_order_of_the_robots_changes_nothing(track):
    tracks = [
        track("r1", "rover", 1, at(0)),
        track("r2", "rover", 2, pass_by(4.0)),
        track("q3", "quadcopter", 3, at(0.3, 0.3, 0.5)),
    ]
    specs = tuple(robot(t.name, t.kind, t.system_id) for t in tracks)
    one, other = (verdict_on(order, specs=specs) for order in (tracks, tracks[::-1]))
    assert len(one.collisions) == 3
    assert one == other


def test_collisions_count_before_all_are_ready_but_separation_does_not(track):
    tracks = [track("r1", "rover", 1, at(0)), track("r2", "rover", 2, pass_by(2.0))]
    verdict = verdict_on(tracks, ready_at=5.0)
    assert len(verdict.collisions) == 1
    assert verdict.min_separation == pytest.approx(np.hypot(3, 0.5), abs=1e-6)
    assert verdict.pairs[0].time == pytest.approx(5.0)


def test_what_comes_after_the_end_does_not_count(track):
    tracks = [track("r1", "rover", 1, at(0)), track("r2", "rover", 2, pass_by(12.0))]
    assert verdict_on(tracks, ended_at=10.0).collisions == ()
    assert len(verdict_on(tracks, ended_at=13.0).collisions) == 1


def test_separation_is_in_space_for_quadcopters_and_in_the_plane_for_rovers(track):
    quads = [track("a", "quadcopter", 1, at(0, 0, 2)), track("b", "quadcopter", 2, at(3, 0, 6))]
    assert verdict_on(quads).min_separation == pytest.approx(5)
    rovers = [track("c", "rover", 1, at(0, 0, 0)), track("d", "rover", 2, at(3, 0, 4))]
    assert verdict_on(rovers).min_separation == pytest.approx(3)


def test_flying_over_a_rover_is_no_separation_but_passing_it_low_is(track):
    rover = track("r", "rover", 1, at(0))
    high = verdict_on([rover, track("q", "quadcopter", 2, at(0.1, 0, 2.0))])
    assert high.min_separation is None
    assert high.classes[0].nearest is None
    low = verdict_on([rover, track("q", "quadcopter", 2, at(1.0, 0, 1.2))])
    assert low.min_separation == pytest.approx(1.0)
    assert low.classes[0].pair_class == "mixed"
    assert low.classes[0].contact == pytest.approx(0.595)


def test_classes_are_summed_up_apart(track):
    tracks = [
        track("r1", "rover", 1, at(0)),
        track("r2", "rover", 2, at(0.7)),
        track("q1", "quadcopter", 3, at(5, 0, 3)),
        track("q2", "quadcopter", 4, at(6, 0, 3)),
    ]
    by_class = {c.pair_class: c for c in verdict_on(tracks).classes}
    assert [by_class[k].pairs for k in by_class] == [1, 1, 4]
    assert [by_class[k].collisions for k in by_class] == [1, 0, 0]
    assert by_class["quadcopter-quadcopter"].nearest.names == ("q1", "q2")


def test_tracks_of_different_length_and_phase_are_judged_where_they_overlap(track):
    early = track("r1", "rover", 1, at(0), 5.0)
    late = track("r2", "rover", 2, pass_by(4.0), 10.0, start=2.003)
    verdict = verdict_on([early, late])
    assert len(verdict.collisions) == 1
    assert verdict.min_separation == pytest.approx(0.5, abs=1e-4)
    apart = track("r3", "rover", 3, at(0), 5.0, start=20.0)
    assert verdict_on([early, apart]).min_separation is None


def test_a_rover_arrives_in_the_plane_and_a_quadcopter_in_space(track):
    def climbing(t):
        return 0.5 * t, 0.0, 0.1 * t

    for kind, speed in (("rover", 0.5), ("quadcopter", np.hypot(0.5, 0.1))):
        spec = robot("a", kind, 1, Goto(target=Point(4, 0, 0.8)))  # there 8 s after boot
        verdict = verdict_on([track("a", kind, 1, climbing)], specs=(spec,), ready_at=2.0)
        assert verdict.robots[0].arrival == pytest.approx(8 - 0.2 / speed - 2, abs=0.011)
        assert verdict.robots[0].path_ratio == pytest.approx(1.0)
        assert verdict.all_arrived
    high = robot("a", "quadcopter", 1, Goto(target=Point(4, 0, 1.5)))
    assert not verdict_on([track("a", "quadcopter", 1, climbing)], specs=(high,)).all_arrived


def test_who_never_gets_there_has_not_arrived_and_the_report_says_how_near_it_came(track):
    spec = robot("a", "rover", 1, Goto(target=Point(9, 0)))
    verdict = verdict_on(
        [track("a", "rover", 1, lambda t: (0.2 * t, 0.0, 0.0))],
        specs=(spec,),
        expect=Expect(all_arrive_within_s=30),
    )
    assert not verdict.all_arrived
    assert verdict.robots[0].arrival is None
    assert verdict.robots[0].miss == pytest.approx(5.0)
    assert not verdict.passed
    assert "a (nearest 5.00 m) did not" in verdict.assertions[0].text


def test_a_detour_shows_in_the_way_ratio(track):
    def square(t):  # 4 m east, 4 m north, at 1 m/s
        return np.clip(t, 0, 4), np.clip(t - 4, 0, 4), 0.0

    spec = robot("a", "rover", 1, Goto(target=Point(4, 4)))
    (result,) = verdict_on([track("a", "rover", 1, square)], specs=(spec,)).robots
    assert result.path_ratio == pytest.approx(8 / np.hypot(4, 4), rel=1e-3)


def test_a_team_that_was_never_ready_has_not_arrived(track):
    spec = robot("a", "rover", 1, Goto(target=Point(0, 0)))
    expect = Expect(all_arrive_within_s=10, min_separation_m=0.1, collisions=0)
    verdict = verdict_on(
        [track("a", "rover", 1, at(0))], specs=(spec,), ready_at=None, expect=expect
    )
    assert not verdict.all_arrived
    assert [a.passed for a in verdict.assertions] == [True, False, False]
    assert "never ready" in verdict.assertions[1].text


CIRCLE = Circle(centre=Point(0, 0, 2), radius=2, speed=1.0)


@pytest.fixture
def circling(track):
    """Make the track of a robot that follows its path with an offset, ready 3 s after boot."""

    def make(spec, offset=(0.0, 0.0, 0.0), seconds=25.0):
        def way(t):
            points = [reference(spec.path, spec, Team(), s - 3.0).position for s in t.tolist()]
            return tuple(np.array(points).T + np.array(offset)[:, None])

        return track(spec.name, spec.kind, spec.system_id, way, seconds)

    return make


def test_a_perfect_track_has_no_tracking_error(circling):
    spec = robot("q", "quadcopter", 1, CIRCLE)
    (result,) = verdict_on([circling(spec)], specs=(spec,), ready_at=3.0).robots
    assert result.rmse == pytest.approx(0, abs=1e-9)
    assert result.arrived
    assert result.arrival == pytest.approx(path_duration(CIRCLE))  # it arrives when its path ends


def test_tracking_error_is_in_space_for_quadcopters_and_in_the_plane_for_rovers(circling):
    for kind, error in (("quadcopter", 0.5), ("rover", 0.3)):
        spec = robot("a", kind, 1, CIRCLE)
        verdict = verdict_on([circling(spec, (0.3, 0, 0.4))], specs=(spec,), ready_at=3.0)
        assert verdict.robots[0].rmse == pytest.approx(error)


def test_who_is_half_a_metre_off_at_the_end_of_its_path_has_not_arrived(circling):
    spec = robot("a", "rover", 1, CIRCLE)
    for offset, arrived in ((0.49, True), (0.51, False)):
        verdict = verdict_on([circling(spec, (offset, 0, 0))], specs=(spec,), ready_at=3.0)
        assert verdict.robots[0].arrived is arrived
        assert verdict.all_arrived is arrived
        assert verdict.robots[0].miss == pytest.approx(offset)


def test_a_run_that_ends_before_the_path_has_not_arrived(circling):
    spec = robot("a", "rover", 1, CIRCLE)
    verdict = verdict_on([circling(spec)], specs=(spec,), ready_at=3.0, ended_at=10.0)
    assert verdict.robots[0].arrived is False


def test_who_holds_a_place_is_measured_until_the_longest_path_ends(track, circling):
    circle = robot("c", "rover", 1, CIRCLE)
    hold = robot("h", "quadcopter", 2, Hold(at=Point(9, 9, 2)))
    end = 3.0 + path_duration(CIRCLE)

    def leaves_at_the_end(t):
        return 9 + np.where(t > end, 100.0, 0.0), 9.0, 2.0

    verdict = verdict_on(
        [circling(circle), track("h", "quadcopter", 2, leaves_at_the_end, 25.0)],
        specs=(circle, hold),
        ready_at=3.0,
    )
    assert verdict.robots[1].rmse == pytest.approx(0, abs=1e-9)


def test_who_holds_elsewhere_has_to_get_there(track):
    away = robot("h", "quadcopter", 1, Hold(at=Point(9, 9, 2)))
    here = robot("s", "quadcopter", 2, Hold(at=Point(0, 0, 2)))
    stays = track("h", "quadcopter", 1, lambda t: (0, 0, 2), 20.0)
    other = track("s", "quadcopter", 2, lambda t: (0, 5, 2), 20.0)
    first, second = verdict_on([stays, other], specs=(away, here), ready_at=3.0).robots
    assert first.arrived is False
    assert second.arrived is None
    goes = track("h", "quadcopter", 1, lambda t: (np.minimum(t, 9), np.minimum(t, 9), 2), 20.0)
    first, _ = verdict_on([goes, other], specs=(away, here), ready_at=3.0).robots
    assert first.arrival == pytest.approx(9 - 0.2 / 2**0.5 - 3, abs=0.02)


def test_who_is_sent_to_its_place_is_measured_there_and_not_on_its_way(track, circling):
    circle = robot("c", "rover", 1, CIRCLE)
    away = robot("h", "rover", 2, Hold(at=Point(3, 30)))

    def measured(begin):
        goes = track("h", "rover", 2, lambda t: (3.1, np.clip(9 * (t - begin), 0, 30), 0), 25.0)
        tracks, specs = [circling(circle), goes], (circle, away)
        return verdict_on(tracks, specs=specs, ready_at=3.0).robots[1]

    soon, late = measured(3.0), measured(5.0)
    assert (soon.rmse, late.rmse) == (pytest.approx(0.1), pytest.approx(0.1))
    end = path_duration(CIRCLE)
    at_the_end = measured(3.0 + end - 6.0)  # it comes there less than 5 s before all is over
    assert end - 5 < at_the_end.arrival < end
    assert (at_the_end.rmse, measured(30.0).rmse) == (None, None)


def test_a_log_that_ends_early_leaves_the_separation_before_it(track):
    specs = tuple(
        robot(n, "quadcopter", i, Hold(at=Point(0, i, 2))) for i, n in ((1, "a"), (2, "b"))
    )
    short = track("a", "quadcopter", 1, lambda t: (0, 0, 2), 10.0)
    whole = track("b", "quadcopter", 2, lambda t: (1, 0, 2), 20.0)
    (pair,) = verdict_on([short, whole], specs=specs, ready_at=1.0).pairs
    assert pair.min_separation == pytest.approx(1.0)


def test_waypoints_count_as_a_path(circling):
    spec = robot("a", "rover", 1, Waypoints(points=(Point(0, 0), Point(6, 0)), speed=0.5))
    (result,) = verdict_on([circling(spec)], specs=(spec,), ready_at=3.0).robots
    assert result.goal == "path"
    assert result.arrived
    assert result.rmse == pytest.approx(0, abs=1e-9)


def test_expectations_become_assertions_with_what_was_seen(track, circling):
    spec = replace(robot("c", "rover", 1, CIRCLE))
    other = robot("h", "rover", 2, Hold(at=Point(9, 9)))
    run = partial(
        verdict_on,
        [circling(spec, (0.1, 0, 0)), track("h", "rover", 2, at(9, 9), 25.0)],
        specs=(spec, other),
        ready_at=3.0,
    )
    good = run(
        expect=Expect(
            collisions=0,
            all_arrive_within_s=13.0,
            tracking_rmse_m={"c": 0.11},
            min_separation_m=1.0,
        )
    )
    assert good.passed
    assert [a.name for a in good.assertions] == [
        "collisions",
        "all_arrive_within_s",
        "tracking_rmse_m.c",
        "min_separation_m",
    ]
    assert good.assertions[1].actual == pytest.approx(path_duration(CIRCLE))
    assert good.assertions[2].text == "c tracks within 0.11 m RMS: 0.100 m"
    bad = run(
        expect=Expect(
            all_arrive_within_s=12.0, tracking_rmse_m={"c": 0.09, "ghost": 1}, min_separation_m=99
        )
    )
    assert not bad.passed
    assert [a.passed for a in bad.assertions] == [False] * 4
    assert bad.assertions[2].actual is None


def test_a_robot_without_truth_fails_to_arrive_and_spoils_nothing_else(track):
    specs = (
        robot("a", "rover", 1, Goto(target=Point(0, 0))),
        robot("b", "rover", 2, Goto(target=Point(5, 5))),
    )
    verdict = verdict_on([track("a", "rover", 1, at(0))], specs=specs)
    assert [r.arrived for r in verdict.robots] == [True, False]
    assert verdict.pairs == ()
    assert verdict_on([], specs=specs).collisions == ()


def test_a_run_that_was_broken_off_decides_only_what_no_later_moment_could_change(track):
    specs = (
        robot("a", "rover", 1, Goto(target=Point(6, 0))),
        robot("b", "rover", 2, Goto(target=Point(6, 3))),
    )
    tracks = [
        track("a", "rover", 1, lambda t: (np.minimum(6.0, 0.5 * t), 0, 0), 13.5),
        track("b", "rover", 2, lambda t: (0.1 * t, 3, 0), 13.5),
    ]
    expect = Expect(
        collisions=0, all_arrive_within_s=30, tracking_rmse_m={"a": 1}, min_separation_m=0.5
    )
    run = partial(verdict_on, tracks, specs=specs, ready_at=2.0, ended_at=13.5, broken_off=True)
    cut_short = run(expect=expect)
    assert [a.passed for a in cut_short.assertions] == [None] * 4
    assert not cut_short.passed
    assert (
        cut_short.assertions[0].text
        == "no collision: none by the time it broke off, 11.5 s after all were ready"
    )
    too_late = run(expect=replace(expect, all_arrive_within_s=11, min_separation_m=4))
    assert [a.passed for a in too_late.assertions] == [None, False, None, False]


def test_what_a_run_had_decided_stays_decided_when_it_is_broken_off(track, circling):
    spec = robot("c", "rover", 1, CIRCLE)
    expect = Expect(collisions=0, all_arrive_within_s=13, tracking_rmse_m={"c": 0.11})
    verdict = verdict_on(
        [circling(spec, (0.1, 0, 0))], specs=(spec,), ready_at=3.0, expect=expect, broken_off=True
    )
    assert [a.passed for a in verdict.assertions] == [None, True, True]
    hits = [track("a", "rover", 1, at(0)), track("b", "rover", 2, at(0.1))]
    (collided,) = verdict_on(hits, expect=Expect(collisions=0), broken_off=True).assertions
    assert collided.passed is False
    (never,) = verdict_on(
        hits, expect=Expect(all_arrive_within_s=3), ready_at=None, broken_off=True
    ).assertions
    assert never.passed is None
    assert never.text.endswith("broke off, before all were ready")


def test_tracks_of_which_none_has_begun_have_no_time_in_common(track):
    nothing = track("a", "rover", 1, at(0), 1)
    nothing = replace(nothing, time=nothing.time[:0], position=nothing.position[:0])
    for tracks in ([], [nothing, nothing]):
        time, position = align(tracks, -np.inf, np.inf)
        assert (len(time), position.shape) == (0, (len(tracks), 3, 0))
