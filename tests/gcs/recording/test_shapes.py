"""The robots are drawn to the size of the paper's Table 1; rotors and wheels turn as they do."""

from dataclasses import replace

import numpy as np
import pytest

from mavherd.gcs.recording.shapes import bottom_of, shape_of, whole
from mavherd.gcs.recording.spin import ROTOR_SHARE, Spin
from mavherd.gcs.recording.stage_marks import dashes

SIZE = {"rover": (0.65, 0.45, 0.9), "quadcopter": (0.4, 0.4, 0.2)}
RED = (200, 30, 30)


@pytest.mark.parametrize("fine", [True, False])
@pytest.mark.parametrize("kind", SIZE)
def test_a_robot_has_the_size_of_table_1_and_stands_on_its_bottom(kind, fine):
    mesh = whole(shape_of(kind, RED, fine=fine))
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    assert high - low == pytest.approx(SIZE[kind], abs=0.03)
    assert np.all(high - low <= np.array(SIZE[kind]) + 0.005)
    assert low[2] == pytest.approx(bottom_of(kind), abs=1e-6)


@pytest.mark.parametrize("kind", ["rover", "quadcopter", "submarine"])
def test_faces_look_outward_and_the_front_is_marked(kind):
    mesh = whole(shape_of(kind, RED))
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    normals = mesh.normals[mesh.triangles[:, 0]]
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1.0, abs=1e-5)
    assert np.all(np.einsum("ij,ij->i", np.cross(b - a, c - a), normals) > 0)
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() > 0  # six times the volume inside
    body = shape_of(kind, RED).body
    marked = body.vertices[(body.colours == (240, 228, 66)).all(axis=1)]
    assert marked[:, 0].min() > 0
    assert np.any((body.colours == RED).all(axis=1))


def spin(track, kind, speeds):
    """Return times, and the angle about its axis of each spinner, for constant speeds in rad/s."""
    names = ("left_wheel_speed_rad_s", "right_wheel_speed_rad_s")
    if kind == "quadcopter":
        names = tuple(f"rotor{i}_speed_rad_s" for i in range(1, 5))
    whole_track = track("x", kind, 1, lambda t: (0, 0, 0), 1.0)
    rows = np.tile(np.array(speeds, dtype=float), (len(whole_track), 1))
    turning = replace(whole_track, actuators=rows, actuator_names=names)
    time, turns = Spin(kind).advance(turning, np.arange(0, 101, 4))
    axis = 1 if kind == "rover" else 2
    assert np.all(np.delete(turns[..., :3], axis, axis=2) == 0)
    return time, np.unwrap(2 * np.arctan2(turns[..., axis], turns[..., 3]), axis=0)


def test_front_and_rear_rotors_turn_clockwise_from_above_the_others_against_it(track):
    time, angle = spin(track, "quadcopter", (600, 600, 500, 0))
    assert len(time) == 26
    wanted = np.array([-600, 600, -500, 0]) * ROTOR_SHARE
    assert angle[-1] - angle[0] == pytest.approx(wanted, rel=1e-6)
    assert np.abs(np.diff(angle, axis=0)).max() < np.pi / 2  # the eye can follow two blades


def test_wheels_turn_forward_at_their_speed(track):
    _, angle = spin(track, "rover", (10.0, -4.0))
    assert angle[-1] - angle[0] == pytest.approx([10.0, -4.0])


def test_what_stands_still_says_so_once(track):
    time, angle = spin(track, "quadcopter", (0, 0, 0, 0))
    assert time.tolist() == [0.0]
    assert angle.tolist() == [[0, 0, 0, 0]]


def test_a_track_without_speeds_has_no_spin(track):
    silent = track("x", "rover", 1, lambda t: (0, 0, 0), 0.1)  # its columns have other names
    assert len(Spin("rover").advance(silent, np.arange(5))[0]) == 0
    assert len(Spin("plane").advance(silent, np.arange(5))[0]) == 0


def test_dashes_cover_half_of_the_way_and_bend_with_it():
    strips = dashes(((0, 0, 0), (3, 0, 0), (3, 4, 0)))
    assert strips[0][0].tolist() == [0, 0, 0]
    assert strips[-1][-1].tolist() == [3, 4, 0]
    lengths = [np.linalg.norm(np.diff(strip, axis=0), axis=1).sum() for strip in strips]
    assert lengths == pytest.approx([7 / (2 * len(strips) - 1)] * len(strips), rel=1e-4)
    assert dashes(()) == []
    assert len(dashes(((0, 0, 0), (9000, 0, 0)))) <= 100
