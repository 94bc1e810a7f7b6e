"""What is plotted of one robot: which numbers, under which names, in which colours and thickness.

All numbers of a robot are components of one entity, `plots/<robot>`: so a recording is a third of
the size. A view takes those of its panel.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..report.truth import Floats
from .stream import rgb

ARCHETYPE = "plot"
TRUE, ASKED = 2.0, 1.0  # line widths in points
_BLUE, _ORANGE, _GREEN, _PINK = "#56B4E9", "#E69F00", "#00B386", "#CC79A7"
_PALE = {_BLUE: "#B4DEF6", _ORANGE: "#F6DFAE", _GREEN: "#A8E3D2", _PINK: "#EBCBDD"}
_WHITE = "#F2F2F2"


class Line(NamedTuple):
    """One of the lines of a panel."""

    name: str
    colour: str
    width: float = TRUE


class Panel(NamedTuple):
    """A plot of one robot; its title says what its colours are, where there are several."""

    title: str
    parts: tuple[tuple[str, tuple[Line, ...]], ...]  # component and its lines
    span: tuple[float, float] | None = None  # of the axis; None: whatever the lines need

    @property
    def name(self) -> str:
        """The title without the colours."""
        return self.title.partition(" (")[0]


def _asked(name: str, colour: str) -> Line:
    return Line(f"{name} asked", _PALE.get(colour, colour), ASKED)


DISTANCE = ("distance", (Line("distance", _WHITE),))
OFFSETS = (
    "offset",
    (Line("east", _BLUE, ASKED), Line("north", _ORANGE, ASKED), Line("up", _GREEN, ASKED)),
)
OFF_TARGET = Panel("Off target, m", (DISTANCE,))
OFFSET = Panel("Offset, m (blue: east; orange: north; green: up)", (OFFSETS,))
OFFSET_FLAT = Panel("Offset, m (blue: east; orange: north)", (OFFSETS,))
SPEED = Panel(
    "Speed, m/s (pale and thin: of the velocity it is sent)",
    (("speed", (Line("speed", _BLUE),)), ("speed_asked", (_asked("speed", _BLUE),))),
)
WHEELED_SPEED = Panel(
    "Speed, m/s (pale: velocity it is sent; orange: asked of wheels)",
    (
        ("speed", (Line("speed", _BLUE),)),
        ("speed_asked", (_asked("speed", _BLUE), Line("asked of the wheels", _ORANGE, ASKED))),
    ),
)
ATTITUDE = Panel(
    "Attitude, ° (blue: roll to the right; orange: nose up; pale: asked)",
    (
        (
            "attitude",
            (
                Line("roll", _BLUE),
                Line("pitch", _ORANGE),
                _asked("roll", _BLUE),
                _asked("pitch", _ORANGE),
            ),
        ),
    ),
    (-35.0, 35.0),  # else +-8 would have no tick but 0; autopilots keep within 30 as a rule
)
HEADING = Panel(
    "Heading, °",
    (("heading", (Line("heading", _GREEN), _asked("heading", _GREEN))),),
)
HEIGHT = Panel("Height, m", (("height", (Line("height", _GREEN), _asked("height", _GREEN))),))
TURN = Panel(
    "Turn left, °/s",
    (("turn", (Line("turn", _GREEN), _asked("turn", _GREEN))),),
)
_ROTORS = tuple(zip("1234", (_BLUE, _ORANGE, _GREEN, _PINK), strict=True))
ROTORS = Panel(
    "Rotors, rad/s",
    (
        (
            "rotors",
            (
                *(Line(f"rotor {n}", colour) for n, colour in _ROTORS),
                *(_asked(f"rotor {n}", colour) for n, colour in _ROTORS),
            ),
        ),
    ),
)
WHEELS = Panel(
    "Wheels, rad/s (blue: left; orange: right; pale: asked)",
    (
        (
            "wheels",
            (
                Line("left", _BLUE),
                Line("right", _ORANGE),
                _asked("left", _BLUE),
                _asked("right", _ORANGE),
            ),
        ),
    ),
)
# By kind; the first three tell where and how fast it is.
PANELS = {
    "quadcopter": (OFF_TARGET, OFFSET, SPEED, ATTITUDE, ROTORS, HEIGHT, HEADING),
    "rover": (OFF_TARGET, OFFSET_FLAT, WHEELED_SPEED, WHEELS, TURN, HEADING),
}
OTHER_PANELS = (OFF_TARGET, OFFSET, SPEED, ATTITUDE, HEIGHT, HEADING)
FEED_FORWARD = "feed_forward"  # m/s, its size: a component too, for the team's plot


def columns(components: dict[str, Floats]) -> list[Any]:
    """Return tables of numbers, (rows, lines) each, as columns of one entity: single precision."""
    import rerun as rr

    found = []
    for name, table in components.items():
        what = rr.ComponentDescriptor(f"{ARCHETYPE}:{name}", archetype=ARCHETYPE)
        numbers = rr.AnyBatchValue(what, table.astype(np.float32).ravel())
        lengths = np.full(len(table), table.shape[1])
        found.append(rr.ComponentColumn(what, numbers, lengths=lengths))
    return found


def drawn(component: str, lines: Sequence[Line], shown: Sequence[bool] | None = None) -> Any:
    """Return how a view draws a component; of its lines, only those that are `shown`."""
    import rerun as rr
    import rerun.blueprint as rrb

    source = rrb.encodings.VisualizerComponentMapping(
        target="Scalars:scalars",
        source_kind=rrb.encodings.ComponentSourceKind.SourceComponent,
        source_component=f"{ARCHETYPE}:{component}",
    )
    style = rr.SeriesLines(
        names=[line.name for line in lines],
        colors=[rgb(line.colour) for line in lines],
        widths=[line.width for line in lines],
        visible_series=shown,
    )
    return style.visualizer(mappings=[source])
