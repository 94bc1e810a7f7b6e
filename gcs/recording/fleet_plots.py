"""The numbers of the team over time: nearness, how old its knowledge is, how fast time goes.

Of a large team they tell the most, the median and what all but a tenth keep below.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from ...transport.wire import Target, VehicleState
from ..report.contact import BODIES, contact_distance, pair_class
from ..report.figure_style import CLASS_COLOUR, on_dark
from ..report.truth import Floats
from .grid import RATE_HZ, Aligned
from .panels import columns
from .stage import FEW, Stage, StagedRobot
from .stream import Stream, rgb
from .timeline import PHASE_COLOURS

SUMMARY = ("most", "nine tenths below", "median")
_SUMMARY_COLOURS = [rgb(colour) for colour in ("#E69F00", "#56B4E9", "#F2F2F2")]
CROWD_EVERY = 4  # steps of the grid: so often each robot of a crowd is recorded
PHASES = tuple(PHASE_COLOURS)
_PATIENCE_S = 1.0  # of the run, for the targets of one moment to come together


class FleetPlots:
    """Writes `fleet/...`; `colours` is #rrggbb by robot."""

    def __init__(self, stream: Stream, stage: Stage, colours: Mapping[str, str]) -> None:
        import rerun as rr

        self._rr = rr
        self._stream = stream
        self._row: dict[str, int] = {}
        self._kinds: list[str] = []
        self._few = len(stage.robots) <= FEW
        self._is_led = bool(stage.law)
        self._contacts: dict[str, float] = {}  # by class of pairs
        self._rows: dict[str, list[tuple[float, Floats]]] = {}
        self._targets: dict[float, Floats] = {}  # places, by time
        self._pushes: dict[float, Floats] = {}
        self._aligned: list[Aligned] = []
        self._phases = np.empty(0)
        for robot in stage.robots:
            self.add_robot(robot)
        self._log_static(colours)

    def add_robot(self, robot: StagedRobot) -> None:
        """Make room for one more robot."""
        self._row[robot.name] = len(self._row)
        for other in self._kinds if robot.kind in BODIES else ():
            label = pair_class(robot.kind, other) if other in BODIES else ""
            if label and label not in self._contacts:
                contact = self._contacts[label] = contact_distance(robot.kind, other)
                paint = rgb(on_dark(CLASS_COLOUR[label]))
                names = [label, f"{label}: contact at {contact:.2f} m"]
                lines = self._rr.SeriesLines(names=names, colors=[paint, paint], widths=[2, 1])
                self._stream.static(f"fleet/separation/{label}", lines)
        self._kinds.append(robot.kind)

    def add_states(self, states: Sequence[VehicleState], now: float) -> None:
        """Keep how old what the coordinator knows is at `now`, and how many are in which phase."""
        if not self._is_led:
            return
        states = [state for state in states if state.name in self._row]
        rows = [self._row[state.name] for state in states]
        ages = np.full(len(self._row), np.nan)
        ages[rows] = [now - state.time for state in states]
        phases = np.bincount([state.phase for state in states], minlength=len(PHASES)).astype(float)
        self._keep("fleet/ages", now, ages if self._few else _summary(ages))
        if not np.array_equal(phases, self._phases):
            self._phases = phases
            self._keep("fleet/phases", now, phases)

    def add_targets(self, targets: Sequence[Target]) -> None:
        """Keep where robots should be and how they are pushed, where robots are many."""
        if self._few:
            return
        together: dict[float, list[Target]] = {}
        for target in targets:
            if target.name in self._row:
                together.setdefault(round(target.time, 3), []).append(target)
        for at, those in together.items():
            rows = [self._row[target.name] for target in those]
            places = self._targets.setdefault(at, np.full((len(self._row), 3), np.nan))
            places[rows] = [target.nominal_position for target in those]
            pushes = self._pushes.setdefault(at, np.full(len(self._row), np.nan))
            pushes[rows] = np.linalg.norm([target.feed_forward for target in those], axis=1)

    def add_poses(self, aligned: Aligned, names: Sequence[str]) -> None:
        """Keep where robots are; the rows of `aligned` are in the order of `names`."""
        if self._few or not len(aligned.time):
            return
        order = [names.index(name) for name in self._row]
        self._aligned.append(Aligned(aligned.time, *(part[order] for part in aligned[1:])))

    def add_separation(self, time: Floats, smallest: Mapping[str, Floats]) -> None:
        """Keep the smallest separation of each class of pairs; NaN where there is none."""
        for label, separation in smallest.items():
            contact = np.full(len(time), self._contacts[label])
            rows = zip(time.tolist(), np.stack([separation, contact], axis=1), strict=True)
            self._rows.setdefault(f"fleet/separation/{label}", []).extend(rows)

    def add_clock(self, now: float, factor: float) -> None:
        """Keep how many times as fast as real time the run goes."""
        self._keep("fleet/factor", now, np.array([factor]))

    def flush(self, *, everything: bool = False) -> None:
        """Record what has gathered."""
        for entity, rows in self._rows.items():
            if not rows:
                continue
            self._send(entity, np.array([t for t, _ in rows]), np.array([v for _, v in rows]))
        self._rows.clear()
        if not self._few:
            self._flush_many(everything)

    def _flush_many(self, everything: bool) -> None:
        whole = max(self._pushes, default=0.0) - (0.0 if everything else _PATIENCE_S)
        done = sorted(at for at in self._pushes if at <= whole)
        if done:
            pushes = np.array([_summary(self._pushes.pop(at)) for at in done])
            self._send("fleet/feed_forward", np.array(done), pushes)
        if not self._aligned:
            return
        time = np.concatenate([part.time for part in self._aligned])
        until = len(time) if everything else int(np.searchsorted(time, whole, "right"))
        late = int(np.searchsorted(time, time[-1] - 2 * _PATIENCE_S))
        count = max(until, late)  # no targets may ever come
        position = np.concatenate([part.position for part in self._aligned], axis=1)
        velocity = np.concatenate([part.velocity for part in self._aligned], axis=1)
        rest = Aligned(time[count:], position[:, count:], velocity[:, count:], np.empty((0, 0, 4)))
        self._aligned = [rest] if count < len(time) else []
        if not count:
            return
        time, speed = time[:count], np.linalg.norm(velocity[:, :count], axis=2).T
        distance = self._distances(time, position[:, :count].swapaxes(0, 1))
        self._send("fleet/speed", time, _summary(speed))
        self._send("fleet/distance", time, _summary(distance))
        each = np.rint(time * RATE_HZ).astype(int) % CROWD_EVERY == 0
        parts = {"speed": speed[each], "distance": distance[each]}
        self._stream.columns("fleet/each", time[each], columns(parts))
        old = [at for at in self._targets if at < time[-1] - 1.0]
        for at in sorted(old)[:-1]:
            del self._targets[at]

    def _distances(self, time: Floats, position: Floats) -> Floats:
        """Return how far from its target each robot is, (t, robots)."""
        told = np.array(sorted(self._targets))
        if not len(told):
            return np.full(position.shape[:2], np.nan)
        places = np.array([self._targets[at] for at in told])
        last = np.searchsorted(told, time + 1e-6, "right") - 1
        after = np.minimum(last + 1, len(told) - 1)
        span = told[after] - told[last]
        share = np.where(span > 0, (time - told[last]) / np.where(span > 0, span, 1.0), 0.0)
        wanted = places[last] + (places[after] - places[last]) * share[:, None, None]
        wanted[(last < 0) | (time - told[last] > _PATIENCE_S)] = np.nan
        off = position - wanted
        off[:, np.array(self._kinds) == "rover", 2] = 0.0
        found: Floats = np.linalg.norm(off, axis=2)
        return found

    def _log_static(self, colours: Mapping[str, str]) -> None:
        rr, put = self._rr, self._stream.static
        blue = rgb("#56B4E9")
        put("fleet/factor", rr.SeriesLines(names="times real time", colors=blue, widths=2))
        steps = rr.components.InterpolationMode.StepAfter
        phases = [rgb(colour) for colour in PHASE_COLOURS.values()]
        put(
            "fleet/phases",
            rr.SeriesLines(names=PHASES, colors=phases, widths=2, interpolation_mode=steps),
        )
        names = list(self._row)
        if self._few:
            each = rr.SeriesLines(names=names, colors=[rgb(colours[n]) for n in names], widths=1.5)
            put("fleet/ages", each)
            return
        summary = rr.SeriesLines(names=SUMMARY, colors=_SUMMARY_COLOURS, widths=[2, 1.5, 1.5])
        for quantity in ("ages", "feed_forward", "speed", "distance"):
            put(f"fleet/{quantity}", summary)

    def _keep(self, entity: str, time: float, values: Floats) -> None:
        self._rows.setdefault(entity, []).append((time, values))

    def _send(self, entity: str, time: Floats, table: Floats) -> None:
        scalars = self._rr.Scalars.columns(scalars=table.ravel())
        self._stream.columns(entity, time, scalars.partition(np.full(len(time), table.shape[1])))


def _summary(values: Floats) -> Floats:
    """Return most, ninth decile and median along the last axis; NaN where nothing is known."""
    known = np.sort(values, axis=-1)  # NaN last
    count = np.isfinite(known).sum(axis=-1)
    found = np.full((*values.shape[:-1], len(SUMMARY)), np.nan)
    for k, share in enumerate((1.0, 0.9, 0.5)):
        at = np.clip(np.rint(share * (count - 1)).astype(int), 0, None)
        found[..., k] = np.take_along_axis(known, at[..., None], axis=-1)[..., 0]
    return found
