"""Triangle meshes made of a few solids: what the robots are built from.

Metres and body axes (x ahead, y left, z up); every vertex has its normal and its colour, and no
faces share vertices, so edges are sharp.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...transport.frames import Triple

Colour = tuple[int, int, int]
Outline = Sequence[tuple[float, float]]


class Mesh(NamedTuple):
    """Vertices with normals and colours, and the triangles between them."""

    vertices: NDArray[np.float32]  # (n, 3)
    normals: NDArray[np.float32]  # (n, 3)
    colours: NDArray[np.uint8]  # (n, 3)
    triangles: NDArray[np.uint32]  # (m, 3), counter-clockwise seen from outside


def join(*parts: Mesh) -> Mesh:
    """Return one mesh of all `parts`."""
    first = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    moved = [part.triangles + start for part, start in zip(parts, first, strict=True)]
    vertices, normals, colours = (np.concatenate([part[k] for part in parts]) for k in range(3))
    return Mesh(vertices, normals, colours, np.concatenate(moved).astype(np.uint32))


def moved(mesh: Mesh, by: Triple) -> Mesh:
    """Return the mesh at another place."""
    return mesh._replace(vertices=mesh.vertices + np.array(by, dtype=np.float32))


def turned(mesh: Mesh, axis: str, angle: float) -> Mesh:
    """Return the mesh turned about the axis "x", "y" or "z" by `angle` (rad, right-handed)."""
    c, s, k = np.cos(angle), np.sin(angle), "xyz".index(axis)
    turn = np.eye(3)
    i, j = (k + 1) % 3, (k + 2) % 3
    turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
    matrix = turn.T.astype(np.float32)
    return mesh._replace(vertices=mesh.vertices @ matrix, normals=mesh.normals @ matrix)


def prism(outline: Outline, low: float, high: float, colour: Colour) -> Mesh:
    """Return a convex `outline` (x, y; counter-clockwise) raised from z `low` to `high`."""
    n = len(outline)
    bottom = [(x, y, low) for x, y in outline]
    top = [(x, y, high) for x, y in outline]
    faces = [top, bottom[::-1]]
    faces += [[bottom[k], bottom[(k + 1) % n], top[(k + 1) % n], top[k]] for k in range(n)]
    return _of_faces(faces, colour)


def box(centre: Triple, size: Triple, colour: Colour) -> Mesh:
    """Return a box by its middle and its full size."""
    x, y, z = (s / 2 for s in size)
    return moved(prism([(-x, -y), (x, -y), (x, y), (-x, y)], -z, z, colour), centre)


def cylinder(radius: float, low: float, high: float, colour: Colour, sides: int = 20) -> Mesh:
    """Return an upright cylinder."""
    return prism(circle(radius, sides), low, high, colour)


def hoop(
    radius: float, wall: float, low: float, high: float, colour: Colour, sides: int = 24
) -> Mesh:
    """Return an upright pipe with the outer `radius`."""
    out, inner = circle(radius, sides), circle(radius - wall, sides)
    faces = []
    for k in range(sides):
        (ax, ay), (bx, by) = out[k], out[(k + 1) % sides]
        (cx, cy), (dx, dy) = inner[(k + 1) % sides], inner[k]
        faces.append([(ax, ay, low), (bx, by, low), (bx, by, high), (ax, ay, high)])
        faces.append([(cx, cy, low), (dx, dy, low), (dx, dy, high), (cx, cy, high)])
        faces.append([(ax, ay, high), (bx, by, high), (cx, cy, high), (dx, dy, high)])
        faces.append([(dx, dy, low), (cx, cy, low), (bx, by, low), (ax, ay, low)])
    return _of_faces(faces, colour)


def circle(radius: float, sides: int) -> list[tuple[float, float]]:
    """Return the corners of a regular polygon, counter-clockwise from x."""
    angles = np.arange(sides) * (2 * np.pi / sides)
    return [(radius * float(np.cos(a)), radius * float(np.sin(a))) for a in angles]


def _of_faces(faces: Sequence[Sequence[Triple]], colour: Colour) -> Mesh:
    """Return the mesh of flat convex faces, each counter-clockwise seen from outside."""
    vertices: list[Triple] = []
    normals: list[NDArray[np.float64]] = []
    triangles: list[tuple[int, int, int]] = []
    for face in faces:
        start = len(vertices)
        a, b, c = (np.array(corner) for corner in face[:3])
        normal = np.cross(b - a, c - b)
        normal /= np.linalg.norm(normal)
        vertices += list(face)
        normals += [normal] * len(face)
        triangles += [(start, start + k, start + k + 1) for k in range(1, len(face) - 1)]
    return Mesh(
        np.array(vertices, dtype=np.float32),
        np.array(normals, dtype=np.float32),
        np.full((len(vertices), 3), colour, dtype=np.uint8),
        np.array(triangles, dtype=np.uint32),
    )
