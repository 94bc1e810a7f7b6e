"""What went over a vehicle's link, from the coordinator's tlog: setpoints, frames, silences.

Times are the coordinator's: that of the tick in lockstep.
"""

from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...transport.errors import MavherdError
from ...transport.mavlink import V2_MARKER
from ...transport.tlog import STAMP, entries
from ..station.station import SYSTEM_ID

_LOCAL_POSITION_NED = 32
_SETPOINTS = (84, 86)  # SET_POSITION_TARGET_LOCAL_NED, SET_POSITION_TARGET_GLOBAL_INT
_OVERTAKEN_US = 500_000  # at most so late comes a frame that others have overtaken

_Ints = NDArray[np.int64]


class Setpoints(NamedTuple):
    """The setpoints that a vehicle was sent. What cannot be told of so few is None."""

    number: int
    window: float | None  # s, from the first to the last
    rate: float | None  # Hz in the window
    mean_age: float | None  # s, of the one that holds at a moment of the window
    longest_gap: float | None  # s: the greatest age


class Link(NamedTuple):
    """What a coordinator and its vehicle said to one another."""

    to_frames: int  # to the vehicle
    to_bytes: int
    from_frames: int
    from_bytes: int
    lost: int  # frames from the vehicle, as their sequence numbers tell
    position_rate: float | None  # Hz of LOCAL_POSITION_NED
    longest_silence: float | None  # s between two frames from the vehicle, or after the last
    oldest_position: float | None  # s, age of its last position when a setpoint was sent


class Traffic(NamedTuple):
    """One vehicle's link over a run."""

    setpoints: Setpoints
    link: Link


class _Frames(NamedTuple):
    """The headers of all frames of a log, in order."""

    time: _Ints  # us
    size: _Ints  # bytes
    sequence: _Ints
    system: _Ints
    component: _Ints
    message: _Ints
    boot_ms: _Ints  # what a LOCAL_POSITION_NED says; of no meaning in others


def read_traffic(path: Path, system_id: int) -> Traffic | None:
    """Return what the log of a vehicle's link tells; None when it is missing, empty or damaged.

    The end of a torn one is left out.
    """
    try:
        data = path.read_bytes()
        bounds = np.fromiter(chain.from_iterable(entries(data, path)), dtype=np.int64)
    except (OSError, MavherdError):
        return None
    return _measure(_headers(data, bounds.reshape(-1, 2)), system_id) if len(bounds) else None


def _headers(data: bytes, bounds: _Ints) -> _Frames:
    raw = np.frombuffer(data + bytes(8), dtype=np.uint8)  # what is read of the last may be shorter
    begin, end = bounds.T
    stamp = raw[begin[:, None] + np.arange(STAMP.size)]
    start = begin + STAMP.size
    v2 = raw[start] == V2_MARKER
    skip = np.where(v2, 4, 2)  # bytes before the sequence number
    sequence, system, component = (raw[start + skip + k].astype(np.int64) for k in range(3))
    number = raw[(start + skip + 3)[:, None] + np.arange(3)].astype(np.int64)
    long = number @ np.array([1, 1 << 8, 1 << 16])
    payload = start + np.where(v2, 10, 6)
    first = payload[:, None] + np.arange(4)
    sent = first < (payload + raw[start + 1])[:, None]  # zeros at its end are not
    boot = np.where(sent, raw[first], 0).astype(np.int64)
    return _Frames(
        time=np.ascontiguousarray(stamp).view(">u8").ravel().astype(np.int64),
        size=end - start,
        sequence=sequence,
        system=system,
        component=component,
        message=np.where(v2, long, number[:, 0]),
        boot_ms=boot @ np.array([1, 1 << 8, 1 << 16, 1 << 24]),
    )


def _measure(frames: _Frames, system_id: int) -> Traffic:
    heard, sent = frames.system == system_id, frames.system == SYSTEM_ID
    setpoints = frames.time[sent & np.isin(frames.message, _SETPOINTS)]
    positions = frames.time[heard & (frames.message == _LOCAL_POSITION_NED)]
    link = Link(
        to_frames=int(sent.sum()),
        to_bytes=int(frames.size[sent].sum()),
        from_frames=int(heard.sum()),
        from_bytes=int(frames.size[heard].sum()),
        lost=_lost(frames, heard),
        position_rate=_rate(positions),
        longest_silence=_longest_silence(frames.time, heard),
        oldest_position=_oldest(positions, setpoints),
    )
    return Traffic(_setpoints(setpoints), link)


def _setpoints(time: _Ints) -> Setpoints:
    gaps = np.diff(time) / 1e6
    window = float(gaps.sum())
    if not window:
        return Setpoints(len(time), None, None, None, None)
    # A gap's setpoint is on average half as old as the gap is long, and holds so long.
    mean_age = float((gaps * gaps).sum()) / 2 / window
    return Setpoints(len(time), window, len(gaps) / window, mean_age, float(gaps.max()))


def _rate(time: _Ints) -> float | None:
    window = float(time[-1] - time[0]) / 1e6 if len(time) > 1 else 0.0
    return (len(time) - 1) / window if window else None


def _lost(frames: _Frames, heard: NDArray[np.bool_]) -> int:
    """Return how many numbers are missing, counted for each component from each start on."""
    life = _lives(frames, heard)
    lost = 0
    for component in np.unique(frames.component[heard]):
        for number in range(life[-1] + 1):
            those = heard & (frames.component == component) & (life == number)
            step = np.diff(frames.sequence[those]) & 0xFF
            overtaken = (step >= 128) & (np.diff(frames.time[those]) < _OVERTAKEN_US)
            place = np.cumsum(np.where(overtaken, step - 256, step))
            seen = np.unique(np.append(place, 0))
            lost += int(seen[-1] - seen[0] + 1) - len(seen)
    return lost


def _lives(frames: _Frames, heard: NDArray[np.bool_]) -> _Ints:
    """Return how often the vehicle had started anew at each frame.

    That is told by positions whose time since boot goes back; before the first of them, the new
    life has begun with the first frame after the longest silence.
    """
    positions = np.flatnonzero(heard & (frames.message == _LOCAL_POSITION_NED))
    begins = np.zeros(len(frames.time), dtype=np.int64)
    for k in np.flatnonzero(np.diff(frames.boot_ms[positions]) < -_OVERTAKEN_US // 1000):
        between = np.flatnonzero(heard[positions[k] : positions[k + 1] + 1]) + positions[k]
        begins[between[1 + int(np.diff(frames.time[between]).argmax())]] = 1
    return np.cumsum(begins)


def _longest_silence(time: _Ints, heard: NDArray[np.bool_]) -> float | None:
    if not heard.any():
        return None
    return float(np.diff(np.append(time[heard], time[-1])).max()) / 1e6


def _oldest(positions: _Ints, setpoints: _Ints) -> float | None:
    if not len(positions):
        return None
    before = np.searchsorted(positions, setpoints, "right")
    known = before > 0
    ages = setpoints[known] - positions[before[known] - 1]
    return float(ages.max()) / 1e6 if len(ages) else None
