"""What the robots look like, to the size of the paper's Table 1. Body axes, metres.

Any other kind than our two is drawn as a plain dart. The front is marked on all of them.
"""

from functools import cache
from math import pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...transport.frames import Triple
from ..report.contact import BODIES
from .meshes import Colour, Mesh, box, circle, cylinder, hoop, join, moved, prism, turned

ROVER_LENGTH, ROVER_WIDTH, ROVER_HEIGHT = 0.65, 0.45, 0.9
WHEEL_RADIUS, WHEEL_WIDTH, HALF_TRACK = 0.0975, 0.042, 0.20
QUAD_RADIUS, QUAD_HEIGHT = 0.20, 0.2  # to the rotor tips
ROTOR_RADIUS = 0.075
ROTOR_UP = 0.055  # of the rotors' plane
DART_LENGTH, DART_HEIGHT = 0.6, 0.12

_OWN: Colour = (1, 0, 1)  # stands for the robot's own colour
_ARM = QUAD_RADIUS - ROTOR_RADIUS
_DECK = 0.30  # upperside of the rover's chassis
_DARK: Colour = (26, 29, 34)
_GREY: Colour = (160, 168, 178)
_LIGHT: Colour = (244, 246, 248)
_MARK: Colour = (240, 228, 66)  # the front, and the blade or spoke that shows the turning


class Shape(NamedTuple):
    """How a kind of robot is drawn: its body, what turns on it and where, and its outline."""

    body: Mesh
    spinner: Mesh | None  # what turns: see spin.py
    places: tuple[Triple, ...]  # of the spinners, in order of their columns in the truth
    top: float  # m above the position; the name stands over it
    wire: tuple[tuple[Triple, ...], ...]  # line strips


def shape_of(kind: str, colour: Colour, *, fine: bool = True) -> Shape:
    """Return how a robot of `kind` looks in `colour`; not `fine`: with fewer faces."""
    shape = _unpainted(kind, fine)
    own = (shape.body.colours == _OWN).all(axis=1, keepdims=True)
    paint = np.where(own, np.array(colour, dtype=np.uint8), shape.body.colours)
    return shape._replace(body=shape.body._replace(colours=paint))


def bottom_of(kind: str) -> float:
    """Return the height at which a robot of `kind` stands, relative to its position."""
    return -QUAD_HEIGHT / 2 if kind == "quadcopter" else 0.0


@cache
def _unpainted(kind: str, fine: bool) -> Shape:
    sides = 24 if fine else 10
    if kind == "rover":
        wheels = ((0.0, HALF_TRACK, WHEEL_RADIUS), (0.0, -HALF_TRACK, WHEEL_RADIUS))  # left, right
        return Shape(_rover(_OWN), _wheel(sides), wheels, ROVER_HEIGHT, _rover_wire())
    if kind == "quadcopter":
        up = ROTOR_UP
        rotors = ((_ARM, 0.0, up), (0.0, -_ARM, up), (-_ARM, 0.0, up), (0.0, _ARM, up))
        body, wire = _quadcopter(_OWN, sides), _quadcopter_wire()
        return Shape(body, _rotor(), rotors, QUAD_HEIGHT / 2, wire)
    return Shape(_dart(_OWN), None, (), DART_HEIGHT, (_outline(DART_HEIGHT / 2),))


def whole(shape: Shape) -> Mesh:
    """Return body and spinners as one mesh, for robots whose spin is not drawn."""
    if shape.spinner is None:
        return shape.body
    return join(shape.body, *(moved(shape.spinner, place) for place in shape.places))


def mesh3d(mesh: Mesh) -> Any:
    """Return a mesh as Rerun takes it."""
    import rerun as rr

    return rr.Mesh3D(
        vertex_positions=mesh.vertices,
        vertex_normals=mesh.normals,
        vertex_colors=mesh.colours,
        triangle_indices=mesh.triangles,
    )


def radius_of(kind: str) -> float:
    """Return the radius of the circle that a robot of `kind` must keep for itself, m."""
    return BODIES[kind].radius if kind in BODIES else DART_LENGTH / 2


@cache
def ring(radius: float, corners: int = 48) -> NDArray[np.float32]:
    """Return a level circle round the position as a closed line strip."""
    points = circle(radius, corners)
    return np.array([(x, y, 0.0) for x, y in (*points, points[0])], dtype=np.float32)


def _rover(colour: Colour) -> Mesh:
    """Return chassis, deck, bumper, castor, and a mast with a head that looks ahead."""
    half, width = ROVER_LENGTH / 2, ROVER_WIDTH - 2 * WHEEL_WIDTH - 0.02
    side = [(-half, 0.09), (-half + 0.05, 0.06), (half - 0.09, 0.06), (half - 0.02, 0.12)]
    side += [(half - 0.02, 0.20), (half - 0.12, _DECK), (-half + 0.03, _DECK), (-half, 0.26)]
    # drawn in x and z, so raised along -y when turned upright
    chassis = turned(prism(side, -width / 2, width / 2, colour), "x", pi / 2)
    arrow = [(0.17, 0.0), (0.04, 0.10), (0.04, -0.10)]
    return join(
        chassis,
        box((0.0, 0.0, 0.185), (0.20, ROVER_WIDTH - 2 * WHEEL_WIDTH - 0.002, 0.06), _DARK),
        box((half - 0.012, 0.0, 0.15), (0.024, width, 0.06), _DARK),
        box((half - 0.0105, 0.10, 0.15), (0.026, 0.06, 0.035), _MARK),
        box((half - 0.0105, -0.10, 0.15), (0.026, 0.06, 0.035), _MARK),
        prism(arrow, _DECK, _DECK + 0.012, _MARK),
        box((-0.13, 0.0, (_DECK + 0.78) / 2), (0.045, 0.045, 0.78 - _DECK), _GREY),
        box((-0.13, 0.0, _DECK + 0.02), (0.12, 0.12, 0.04), _DARK),
        box((-0.11, 0.0, 0.81), (0.10, 0.24, 0.09), colour),
        box((-0.055, 0.06, 0.81), (0.02, 0.06, 0.05), _DARK),
        box((-0.055, -0.06, 0.81), (0.02, 0.06, 0.05), _DARK),
        moved(cylinder(0.045, 0.0, 0.045, _DARK), (-0.13, 0.0, ROVER_HEIGHT - 0.045)),
        moved(turned(cylinder(0.05, -0.015, 0.015, _DARK), "x", pi / 2), (-0.25, 0.0, 0.05)),
    )


def _wheel(sides: int) -> Mesh:
    """Return a wheel about y with three spokes on both faces, one of them marked."""
    half = WHEEL_WIDTH / 2
    parts = [
        cylinder(WHEEL_RADIUS, -half, half, _DARK, sides),
        cylinder(0.066, -half - 0.002, half + 0.002, _GREY, sides),
        cylinder(0.018, -half - 0.004, half + 0.004, _DARK, sides),
    ]
    for k, colour in enumerate((_MARK, _DARK, _DARK)):
        spoke = box((0.042, 0.0, 0.0), (0.048, 0.02, WHEEL_WIDTH + 0.006), colour)
        parts.append(turned(spoke, "z", k * 2 * pi / 3))
    return turned(join(*parts), "x", pi / 2)


def _quadcopter(colour: Colour, sides: int) -> Mesh:
    """Return hub, arms, motors, guards in the robot's colour, skids; the front arm is marked."""
    parts = [
        prism(circle(0.062, 8), -0.022, 0.024, colour),
        prism(circle(0.040, 8), 0.024, 0.040, _DARK),
        prism([(0.075, 0.0), (0.035, 0.03), (0.035, -0.03)], -0.012, 0.032, _MARK),
        box((0.0, 0.0, -0.035), (0.09, 0.05, 0.028), _DARK),
        cylinder(0.012, 0.04, QUAD_HEIGHT / 2, _DARK, 8),
    ]
    for k, arm_colour in enumerate((_MARK, _DARK, _DARK, _DARK)):
        arm = box((0.09, 0.0, 0.006), (0.09, 0.016, 0.014), arm_colour)
        motor = moved(cylinder(0.016, 0.0, ROTOR_UP - 0.006, _DARK, 12), (_ARM, 0.0, 0.0))
        guard = hoop(ROTOR_RADIUS, 0.006, ROTOR_UP - 0.012, ROTOR_UP + 0.008, colour, sides)
        parts += [turned(part, "z", k * pi / 2) for part in (arm, motor)]
        parts.append(turned(moved(guard, (_ARM, 0.0, 0.0)), "z", k * pi / 2))
    for y in (-0.06, 0.06):
        parts.append(box((0.0, y, -QUAD_HEIGHT / 2 + 0.006), (0.17, 0.012, 0.012), _GREY))
        for x in (-0.045, 0.045):
            leg = box((x, y, -0.055), (0.010, 0.010, 0.085), _GREY)
            parts.append(leg)
    return join(*parts)


def _rotor() -> Mesh:
    """Return two blades about z; the tip of one is marked."""
    tip = ROTOR_RADIUS - 0.009
    blade = prism([(0.0, -0.006), (0.02, -0.011), (tip, -0.006), (tip, 0.005), (0.02, 0.007)],
                  -0.002, 0.002, _LIGHT)  # fmt: skip
    mark = prism([(tip - 0.022, -0.0085), (tip, -0.0065), (tip, 0.006), (tip - 0.022, 0.0065)],
                 -0.003, 0.003, _MARK)  # fmt: skip
    return join(blade, turned(blade, "z", pi), mark, cylinder(0.009, -0.004, 0.010, _DARK, 10))


def _dart(colour: Colour) -> Mesh:
    half = DART_LENGTH / 2
    left = [(half, 0.0), (-half, 0.2), (-half + 0.12, 0.0)]
    right = [(half, 0.0), (-half + 0.12, 0.0), (-half, -0.2)]
    nose = [(half + 0.01, 0.0), (half - 0.14, 0.065), (half - 0.14, -0.065)]
    return join(
        prism(left, 0.0, DART_HEIGHT, colour),
        prism(right, 0.0, DART_HEIGHT, colour),
        prism(nose, -0.005, DART_HEIGHT + 0.005, _MARK),
    )


def _outline(up: float) -> tuple[Triple, ...]:
    half = DART_LENGTH / 2
    corners = [(half, 0.0), (-half, 0.2), (-half + 0.12, 0.0), (-half, -0.2), (half, 0.0)]
    return tuple((x, y, up) for x, y in corners)


def _rover_wire() -> tuple[tuple[Triple, ...], ...]:
    """Return the edges of the chassis, and the mast."""
    x, y = ROVER_LENGTH / 2, ROVER_WIDTH / 2
    corners = [(x, y), (-x, y), (-x, -y), (x, -y), (x, y)]
    levels = [tuple((a, b, up) for a, b in corners) for up in (0.02, _DECK)]
    posts = [((a, b, 0.02), (a, b, _DECK)) for a, b in corners[:4]]
    return (*levels, *posts, ((-0.13, 0.0, _DECK), (-0.13, 0.0, ROVER_HEIGHT)))


def _quadcopter_wire() -> tuple[tuple[Triple, ...], ...]:
    """Return a cross and a circle through the rotor tips."""
    r = QUAD_RADIUS
    outline = circle(r, 16)
    around: tuple[Triple, ...] = tuple((x, y, 0.0) for x, y in (*outline, outline[0]))
    return (around, ((-r, 0.0, 0.0), (r, 0.0, 0.0)), ((0.0, -r, 0.0), (0.0, r, 0.0)))
