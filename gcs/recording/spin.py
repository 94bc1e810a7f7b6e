"""How rotors and wheels turn, as the eye can follow it."""

import numpy as np
from numpy.typing import NDArray

from ..report.truth import Floats, Track

ROTOR_SHARE = 1 / 80  # of the true speed: a hovering quadcopter's rotors turn about once a second
_ROTORS = tuple(f"rotor{k}_speed_rad_s" for k in range(1, 5))
_WHEELS = ("left_wheel_speed_rad_s", "right_wheel_speed_rad_s")


class Spin:
    """Integrates the speeds of one robot's spinners; batches of truth follow one another.

    Rotors 1 and 3 (front, rear) turn clockwise seen from above, 2 and 4 the other way; wheels
    turn forward about +y, at their true speed.
    """

    def __init__(self, kind: str) -> None:
        self.entity = "wheels" if kind == "rover" else "rotors"
        self._columns = {"rover": _WHEELS, "quadcopter": _ROTORS}.get(kind, ())
        self._axis = 1 if kind == "rover" else 2  # y or z
        rotors = ROTOR_SHARE * np.array([-1.0, 1.0, -1.0, 1.0])
        self._share = np.ones(2) if kind == "rover" else rotors
        self._angle = np.zeros(len(self._columns))
        self._time: float | None = None

    def advance(self, track: Track, rows: NDArray[np.int_]) -> tuple[Floats, Floats]:
        """Return times and attitudes (t, spinners, x y z w) at those of `rows` where they turn.

        The first attitude of all is among them: at rest.
        """
        names = track.actuator_names
        if not self._columns or not len(track) or not set(self._columns) <= set(names):
            return np.empty(0), np.empty((0, 0, 4))
        which = [names.index(name) for name in self._columns]
        speed = np.nan_to_num(track.actuators[:, which]) * self._share
        is_first = self._time is None
        before = track.time[0] if self._time is None else self._time
        dt = np.clip(np.diff(track.time, prepend=before), 0.0, 1.0)
        angle = self._angle + np.cumsum(speed * dt[:, None], axis=0)
        turning = (speed[rows] != 0).any(axis=1)
        turning[:1] |= is_first and len(rows) > 0
        self._time = float(track.time[-1])
        self._angle = np.remainder(angle[-1], 4 * np.pi)
        rows = rows[turning]
        turns = np.zeros((len(rows), len(which), 4))
        turns[..., self._axis] = np.sin(angle[rows] / 2)
        turns[..., 3] = np.cos(angle[rows] / 2)
        return track.time[rows], turns
