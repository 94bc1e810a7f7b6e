"""Truth that comes robot by robot is brought together, and judged as the judge does."""

from dataclasses import replace

import numpy as np
import pytest

from mavherd.gcs.recording.grid import Grid
from mavherd.gcs.recording.nearness import NEAR_M, Nearness
from mavherd.gcs.report.contact import CLASSES, align, examine, pair_class, separations


def part(track, begin, end):
    """Return the rows of a track from `begin` to before `end`."""
    rows = slice(*np.searchsorted(track.time, [begin - 1e-6, end - 1e-6]))
    names = ("time", "position", "velocity", "quaternion")
    fields = {name: getattr(track, name)[rows] for name in names}
    return replace(track, **fields)


def grid_of(*names):
    grid = Grid()
    for name in names:
        grid.add_robot(name)
    return grid


def watch(tracks, batch):
    """Return what nearness finds in batches of `batch` seconds: times, smallest, gaps, contacts."""
    grid, nearness = grid_of(*(track.name for track in tracks)), Nearness()
    for track in tracks:
        nearness.add_robot(track.name, track.kind)
    found = []
    for begin in np.arange(0.0, tracks[0].time[-1] + batch, batch):
        for track in tracks:
            grid.add(part(track, begin, begin + batch))
        aligned = grid.take()
        found.append(nearness.examine(aligned.time, grid.names, aligned.position))
    labels = {label for near in found for label in near.smallest}
    return (
        np.concatenate([near.time for near in found]),
        {k: np.concatenate([near.smallest[k] for near in found]) for k in labels},
        {t.name: np.concatenate([near.clearance[t.name] for near in found]) for t in tracks},
        [contact for near in found for contact in near.contacts],
    )


@pytest.fixture
def swarm(track):
    """Sixteen robots of each kind that run and fly through one another."""
    rng = np.random.default_rng(6)

    def way(kind):
        east, north, a, b = rng.uniform(-6, 6, 4)
        up = rng.uniform(0.5, 1.4) if kind == "quadcopter" else 0.0
        speed = rng.uniform(0.2, 0.5)
        return lambda t: (
            east + a * np.sin(speed * t),
            north + b * np.sin(speed * t + 1),
            up * (1 - np.cos(0.4 * t)) / 1.4,
        )

    return [
        track(f"{kind}{i}", kind, 1 + i + 100 * (kind == "rover"), way(kind), 20.0)
        for kind in ("quadcopter", "rover")
        for i in range(16)
    ]


@pytest.mark.parametrize("batch", [0.7, 5.0])
def test_a_swarm_is_judged_as_the_judge_does_at_the_same_times(swarm, batch):
    time, smallest, clearance, contacts = watch(swarm, batch)
    assert time == pytest.approx(np.arange(401) / 20)
    kinds = [track.kind for track in swarm]
    position = align(swarm, 0.0, 20.0, rate=20).position
    best = {label: np.full(len(time), np.inf) for label in CLASSES}
    for i in range(len(swarm) - 1):
        _, squared = separations(kinds, position, i, slice(i + 1, None))
        for row, kind in zip(squared, kinds[i + 1 :], strict=True):
            label = pair_class(kinds[i], kind)
            best[label] = np.minimum(best[label], np.sqrt(row))
    for label in CLASSES:
        assert np.nan_to_num(smallest[label], nan=np.inf) == pytest.approx(best[label])

    # what is sampled five times as often sees every contact, and those too short for us
    _, judged = examine(swarm, 0.0, 20.0)
    assert 10 < len(contacts) <= len(judged)
    first = {}
    for collision in judged:
        first.setdefault(frozenset(collision.names), []).append(collision)
    for contact in contacts:
        nearest = min(
            first[frozenset(contact.names)], key=lambda other: abs(other.time - contact.time)
        )
        assert 0 <= contact.time - nearest.time + 1e-9 < 0.05
        assert contact.place == pytest.approx(nearest.position, abs=0.2)
        assert clearance[contact.names[0]][round(contact.time * 20)] < 0


def test_clearance_is_between_bodies_and_counts_height(track):
    tracks = [
        track("r1", "rover", 1, lambda t: (0, 0, 0), 1.0),
        track("r2", "rover", 2, lambda t: (2 * 0.395 + 0.3, 0, 0), 1.0),
        track("q3", "quadcopter", 3, lambda t: (0, 0, 1.4), 1.0),
    ]
    _, smallest, clearance, contacts = watch(tracks, 1.0)
    assert clearance["r2"] == pytest.approx(np.full(21, 0.3))
    assert clearance["r1"] == pytest.approx(np.full(21, 0.3))  # the quadcopter is 0.4 m above it
    assert clearance["q3"] == pytest.approx(np.full(21, 0.4))
    assert smallest["mixed"] == pytest.approx(np.zeros(21))
    assert contacts == []
    assert clearance["r1"][0] < NEAR_M


def test_one_contact_lasts_until_the_two_are_clear_even_across_batches(track):
    gap = lambda t: 0.4 + 0.05 * np.sin(2 * t) + np.where((t > 8) & (t < 9), 0.2, 0.0)  # noqa: E731
    tracks = [
        track("q1", "quadcopter", 1, lambda t: (0, 0, 2), 12.0),
        track("q2", "quadcopter", 2, lambda t: (gap(t), 0, 2), 12.0),
    ]
    *_, contacts = watch(tracks, 0.5)
    assert [contact.names for contact in contacts] == [("q1", "q2")] * 2
    assert contacts[0].time == pytest.approx(np.pi / 2, abs=0.05)
    assert 9 <= contacts[1].time < 12


def test_other_kinds_are_left_out_and_nobody_at_all_is_no_error(track):
    nearness = Nearness()
    grid = grid_of("plane")
    nearness.add_robot("plane", "plane")
    grid.add(track("plane", "rover", 1, lambda t: (0, 0, 0), 1.0))
    aligned = grid.take()
    near = nearness.examine(aligned.time, grid.names, aligned.position)
    assert (near.smallest, near.clearance, near.contacts) == ({}, {}, [])
    empty = grid_of().take()
    assert len(Nearness().examine(empty.time, (), empty.position).time) == 0


def test_the_slow_are_waited_for_but_not_for_ever(track):
    grid = grid_of("a", "b", "c")
    for name in "ab":
        grid.add(track(name, "rover", 1, lambda t: (t, 0, 0), 1.0))
    assert len(grid.take().time) == 0  # nothing from c yet
    for name in "ab":
        grid.add(track(name, "rover", 1, lambda t: (t, 0, 0), 3.0, start=1.01))
    aligned = grid.take()
    assert aligned.time == pytest.approx(np.arange(41) / 20)  # to two seconds before the newest
    assert aligned.position[1, :, 0] == pytest.approx(aligned.time)
    assert np.isnan(aligned.position[2]).all()
    assert grid.take(everything=True).time == pytest.approx(np.arange(41, 81) / 20)


def test_telemetry_that_falls_between_the_times_is_interpolated(track):
    grid, whole = grid_of("a"), track("a", "rover", 1, lambda t: (2 * t, 0, 0), 4.0)
    kept = np.concatenate([np.arange(3, 190, 13), np.arange(320, 400, 13)])  # a gap of 1.4 s
    for rows in np.array_split(kept, 5):
        fields = ("time", "position", "velocity", "quaternion")
        grid.add(replace(whole, **{name: getattr(whole, name)[rows] for name in fields}))
    aligned = grid.take(everything=True)
    place = aligned.position[0, :, 0]
    silent = (aligned.time > 1.86) & (aligned.time < 3.2)
    assert silent.sum() > 20
    assert np.isnan(place[silent]).all()
    assert place[~silent] == pytest.approx(2 * aligned.time[~silent])
