"""What a recording shows, in Rerun's terms: robots, trails, targets, plots, modes and events.

All of it is ENU over the timeline `sim_time`. Rerun is imported when a scene is made.
"""

from collections.abc import Sequence
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any

import numpy as np

from ...transport.wire import Target, VehicleState
from ..mode_names import mode_name
from ..report.contact import contact_distance, pair_class
from ..report.figure_style import CLASS_COLOUR, robot_colours
from ..report.truth import Floats, Track
from .look import NAMED, Colour, blueprint, log_robot
from .robots import RecordedRobot
from .separation import LiveSeparation

POSE_EVERY = 2  # rows of the 100 Hz truth
PLOT_EVERY = 5
TRAIL_EVERY = 25
TRAIL_POINTS = 80  # the last 20 s
TARGET_PERIOD_S = 0.1
REMEMBER_ROWS = 3000  # of truth, for targets that come late
TIMELINE = "sim_time"


class RobotEntry:
    """What the scene remembers of one robot between batches."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.rows = 0
        self.trail = np.empty((0, 3))
        self.truth_time = np.empty(0)  # the newest, to compare targets with
        self.truth_position = np.empty((0, 3))
        self.targets: list[Target] = []  # that wait for truth
        self.last_target = -np.inf
        self.shown: tuple[str, str] = ("", "")  # mode and phase


class Scene:
    """Writes one recording."""

    def __init__(self, path: Path, run_id: str, robots: Sequence[RecordedRobot]) -> None:
        import rerun as rr

        self._rr = rr
        kinds = {robot.name: robot.kind for robot in robots}
        self._colours = robot_colours(kinds)
        self._robots = {name: RobotEntry(kind) for name, kind in kinds.items()}
        self._separation = LiveSeparation(kinds)
        self._classes = {
            pair_class(one, other): (one, other)
            for one, other in combinations_with_replacement(sorted(set(kinds.values())), 2)
            if one != other or list(kinds.values()).count(one) > 1
        }
        self._rec = rr.RecordingStream("mavherd", recording_id=run_id)
        self._rec.set_sinks(rr.FileSink(path), default_blueprint=blueprint(robots))
        self._rec.set_log_tick_enabled(False)
        self._log_static(robots)

    def add_truth(self, track: Track) -> None:
        """Record the rows of `track`, which follow those given before."""
        rr, robot, name = self._rr, self._robots[track.name], track.name
        row = np.arange(robot.rows, robot.rows + len(track))
        robot.rows += len(track)
        pose, plot, trail = (row % every == 0 for every in (POSE_EVERY, PLOT_EVERY, TRAIL_EVERY))
        xyzw = track.quaternion[pose][:, [1, 2, 3, 0]]
        poses = rr.Transform3D.columns(translation=track.position[pose], quaternion=xyzw)
        self._send(f"world/{name}", track.time[pose], poses)
        speed = np.linalg.norm(track.velocity[plot], axis=1)
        self._send(f"plots/speed/{name}", track.time[plot], rr.Scalars.columns(scalars=speed))
        self._add_trail(name, robot, track.time[trail], track.position[trail])
        robot.truth_time = np.concatenate([robot.truth_time, track.time])
        robot.truth_position = np.concatenate([robot.truth_position, track.position])
        self._separation.add(track)

    def add_states(self, states: Sequence[VehicleState]) -> None:
        """Record modes and phases where they changed."""
        for state in states:
            robot = self._robots.get(state.name)
            if robot is None:
                continue
            mode = mode_name(robot.kind, state.custom_mode) + ("" if state.armed else " disarmed")
            shown = (mode, state.phase.name.lower())
            for group, old, new in zip(("mode", "phase"), robot.shown, shown, strict=True):
                if old != new:
                    self._log(f"{group}/{state.name}", state.time, self._rr.StateChange(state=new))
            robot.shown = shown

    def add_target(self, target: Target) -> None:
        """Record where a robot should be; how far off it is follows when its truth is here."""
        robot = self._robots.get(target.name)
        if robot is not None and target.time >= robot.last_target + TARGET_PERIOD_S - 1e-6:
            robot.last_target = target.time
            robot.targets.append(target)

    def add_event(self, time: float, vehicle: str | None, kind: str, text: str) -> None:
        """Record one line of the event log."""
        line = f"{vehicle}: {text}" if vehicle else text
        level = self._rr.TextLogLevel.INFO if kind != "text" else self._rr.TextLogLevel.DEBUG
        self._log("events", time, self._rr.TextLog(line, level=level))

    def flush(self, *, everything: bool = False) -> None:
        """Write what has gathered."""
        for name, robot in self._robots.items():
            self._send_targets(name, robot, everything)
            robot.truth_time = robot.truth_time[-REMEMBER_ROWS:]
            robot.truth_position = robot.truth_position[-REMEMBER_ROWS:]
        time, smallest = self._separation.take(everything=everything)
        for label, separation in smallest.items():
            seen = np.isfinite(separation)
            columns = self._rr.Scalars.columns(scalars=separation[seen])
            self._send(f"plots/separation/{label}", time[seen], columns)
            contact = [contact_distance(*self._classes[label])] * 2
            ends = time[[0, -1]] if len(time) > 1 else time[[0, 0]]
            columns = self._rr.Scalars.columns(scalars=contact)
            self._send(f"plots/separation/{label}/contact", ends, columns)

    def close(self) -> None:
        """Write the rest and end the file."""
        self.flush(everything=True)
        try:
            self._rec.flush(timeout_sec=30)
        finally:
            self._rec.disconnect()

    def _log_static(self, robots: Sequence[RecordedRobot]) -> None:
        rr, rec = self._rr, self._rec
        rec.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for robot in robots:
            rgb = _rgb(self._colours[robot.name])
            log_robot(rec, robot, rgb, named=len(robots) <= NAMED)
            for plot in ("speed", "error"):
                lines = rr.SeriesLines(names=robot.name, colors=rgb, widths=1.5)
                rec.log(f"plots/{plot}/{robot.name}", lines, static=True)
        for label, (one, other) in self._classes.items():
            entity, rgb = f"plots/separation/{label}", _rgb(CLASS_COLOUR[label])
            rec.log(entity, rr.SeriesLines(names=label, colors=rgb, widths=2), static=True)
            contact = f"contact {contact_distance(one, other):.2f} m"
            lines = rr.SeriesLines(names=contact, colors=rgb, widths=1)
            rec.log(f"{entity}/contact", lines, static=True)

    def _add_trail(self, name: str, robot: RobotEntry, time: Floats, position: Floats) -> None:
        if not len(time):
            return
        line = np.concatenate([robot.trail, position])
        known = len(robot.trail)
        # a strip for every second new point is smooth enough to look at
        ends = [k for k in range(known + 1, len(line) + 1) if k >= 2 and (k - known) % 2 == 0]
        strips = [line[max(0, end - TRAIL_POINTS) : end] for end in ends]
        if strips:
            columns = self._rr.LineStrips3D.columns(strips=strips)
            self._send(f"trails/{name}", time[[end - known - 1 for end in ends]], columns)
        robot.trail = line[-TRAIL_POINTS:]

    def _send_targets(self, name: str, robot: RobotEntry, everything: bool) -> None:
        newest = robot.truth_time[-1] if len(robot.truth_time) else -np.inf
        ready = [t for t in robot.targets if everything or t.time <= newest]
        if not ready:
            return
        robot.targets = robot.targets[len(ready) :]
        time = np.array([target.time for target in ready])
        wanted = np.array([target.nominal_position for target in ready])
        self._send(f"world/targets/{name}", time, self._rr.Points3D.columns(positions=wanted))
        if len(robot.truth_time):
            axes = range(2 if robot.kind == "rover" else 3)
            true = [np.interp(time, robot.truth_time, robot.truth_position[:, a]) for a in axes]
            error = np.linalg.norm(np.array(true).T - wanted[:, : len(axes)], axis=1)
            self._send(f"plots/error/{name}", time, self._rr.Scalars.columns(scalars=error))

    def _send(self, entity: str, time: Floats, columns: Any) -> None:
        if len(time):
            index = self._rr.TimeColumn(TIMELINE, duration=time)
            self._rec.send_columns(entity, indexes=[index], columns=columns)

    def _log(self, entity: str, time: float, what: Any) -> None:
        self._rec.set_time(TIMELINE, duration=time)
        self._rec.log(entity, what)


def _rgb(colour: str) -> Colour:
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue
