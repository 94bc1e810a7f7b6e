"""The numbers of one robot over time: how far off, how fast and how it turns, asked and done."""

from typing import NamedTuple

import numpy as np

from ...transport.wire import Target
from ..report.truth import Floats, Track
from .panels import FEED_FORWARD, columns
from .stream import Stream

RATE_HZ = 20
PATIENCE_S = 1.0  # of the run: so long truth waits for the targets of its time
STALE_S = 0.5  # a target before which there was none for longer says nothing of the time between
_SLACK = 1e-6  # of a period: times are sums of steps


class Truth(NamedTuple):
    """Rows that wait to be recorded."""

    time: Floats
    position: Floats
    velocity: Floats
    quaternion: Floats
    rates: Floats
    actuators: Floats
    commands: Floats


class RobotPlot:
    """Writes `plots/<robot>`: all its numbers are components of one entity."""

    def __init__(self, stream: Stream, name: str, kind: str) -> None:
        self._stream = stream
        self._name = name
        self._is_rover = kind == "rover"
        self._truth: list[Truth] = []
        self._actuator_names: tuple[str, ...] = ()
        self._command_names: tuple[str, ...] = ()
        self._targets: list[Target] = []
        self._step = -1  # the last that was recorded
        self._heading = 0.0  # then: so that it goes on beyond half a turn

    def add_truth(self, track: Track) -> None:
        """Keep the rows of `track`, which follow those given before, at the rate of the plots."""
        step = np.floor(track.time * RATE_HZ + _SLACK).astype(int)
        new = np.diff(step, prepend=self._step) > 0
        if not new.any():
            return
        self._step = int(step[-1])
        self._actuator_names, self._command_names = track.actuator_names, track.command_names
        table = (track.position, track.velocity, track.quaternion, track.rates)
        own = (track.actuators, track.commands)
        rows = [part[new] if len(part) else np.empty((int(new.sum()), 0)) for part in own]
        self._truth.append(Truth(track.time[new], *(part[new] for part in table), *rows))

    def add_target(self, target: Target) -> None:
        """Keep where it should be and what it is asked."""
        self._targets.append(target)

    def flush(self, *, everything: bool = False) -> None:
        """Record the rows whose targets have come, or will not."""
        if not self._truth:
            return
        truth = Truth(*(np.concatenate(parts) for parts in zip(*self._truth, strict=True)))
        until = truth.time[-1] - PATIENCE_S
        if self._targets:
            until = max(until, self._targets[-1].time)
        count = len(truth.time) if everything else int(np.searchsorted(truth.time, until, "right"))
        self._truth = [Truth(*(part[count:] for part in truth))] if count < len(truth.time) else []
        if count:
            self._record(Truth(*(part[:count] for part in truth)))

    def _record(self, truth: Truth) -> None:
        found = self._motion(truth) | self._actuators(truth)
        found |= self._against_targets(truth)
        self._stream.columns(f"plots/{self._name}", truth.time, columns(found))
        behind = [t for t in self._targets if t.time <= truth.time[-1]]
        self._targets = behind[-1:] + self._targets[len(behind) :]

    def _motion(self, truth: Truth) -> dict[str, Floats]:
        w, x, y, z = truth.quaternion.T
        heading = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        heading = np.unwrap(np.concatenate([[self._heading], heading]))[1:]
        self._heading = float(heading[-1]) if np.isfinite(heading[-1]) else 0.0
        found = {"speed": np.linalg.norm(truth.velocity, axis=1)[:, None]}
        if self._is_rover:
            turn = self._command(truth, "yaw_rate_command_rad_s")
            found["turn"] = np.degrees(np.stack([truth.rates[:, 2], turn], axis=1))
            found["heading"] = np.degrees(heading)[:, None]
            return found
        roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        nose_up = -np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
        asked_roll = self._command(truth, "roll_command_rad")
        asked_up = -self._command(truth, "pitch_command_rad")
        yaw = self._command(truth, "yaw_command_rad")
        asked_heading = heading + (yaw - heading + np.pi) % (2 * np.pi) - np.pi
        angles = np.stack([roll, nose_up, asked_roll, asked_up], axis=1)
        found["attitude"] = np.degrees(angles)
        found["heading"] = np.degrees(np.stack([heading, asked_heading], axis=1))
        return found

    def _actuators(self, truth: Truth) -> dict[str, Floats]:
        """Return speeds and then commands of the rotors or wheels, where they are known."""
        names = self._actuator_names
        order = [k for part in ("_speed_", "_command_") for k, n in enumerate(names) if part in n]
        if not order or len(order) != (4 if self._is_rover else 8):
            return {}
        return {"wheels" if self._is_rover else "rotors": truth.actuators[:, order]}

    def _against_targets(self, truth: Truth) -> dict[str, Floats]:
        wanted, asked, pushed = self._wanted(truth.time)
        offset = truth.position - wanted
        if self._is_rover:
            offset[:, 2] *= 0.0  # its height is the ground's
        found = {
            "distance": np.linalg.norm(offset, axis=1)[:, None],
            "offset": offset,
            FEED_FORWARD: pushed[:, None],
        }
        if self._is_rover:
            wheels = self._command(truth, "speed_command_m_s")
            found["speed_asked"] = np.stack([asked, wheels], axis=1)
        else:
            found["speed_asked"] = asked[:, None]
            found["height"] = np.stack([truth.position[:, 2], wanted[:, 2]], axis=1)
        return found

    def _wanted(self, time: Floats) -> tuple[Floats, Floats, Floats]:
        """Return by time the nominal place, the speed asked for, and the size of feed-forward."""
        unknown = np.full(len(time), np.nan)
        if not self._targets:
            return np.full((len(time), 3), np.nan), unknown, unknown
        told = np.array([t.time for t in self._targets])
        place = np.array([t.nominal_position for t in self._targets])
        speed = np.linalg.norm([t.command_velocity for t in self._targets], axis=1)
        push = np.linalg.norm([t.feed_forward for t in self._targets], axis=1)
        last = np.searchsorted(told, time + _SLACK, "right") - 1
        known = (last >= 0) & (time - told[last] < STALE_S)
        after = np.minimum(last + 1, len(told) - 1)
        span = told[after] - told[last]
        joined = (span > 0) & (span < STALE_S)
        share = np.where(joined, (time - told[last]) / np.where(joined, span, 1.0), 0.0)
        between = place[last] + (place[after] - place[last]) * share[:, None]
        return (
            np.where(known[:, None], between, np.nan),
            np.where(known, speed[last], np.nan),
            np.where(known, push[last], np.nan),
        )

    def _command(self, truth: Truth, name: str) -> Floats:
        if name not in self._command_names:
            return np.full(len(truth.time), np.nan)
        return truth.commands[:, self._command_names.index(name)]
