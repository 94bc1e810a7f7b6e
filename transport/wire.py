"""What travels on Zenoh: fixed-size structs in ENU, SI, little-endian. See docs/zenoh.md.

Keys live under `mavherd/<run>/`: `vehicle/<name>/state`, `vehicle/<name>/target`,
`vehicle/<name>/alive` (liveliness token), `team`, `snapshot`, `events`, `clock`.
"""

import struct
from collections.abc import Sequence
from enum import IntEnum
from functools import cache, lru_cache
from typing import Any, NamedTuple

from .errors import MavherdError

SCHEMA = 1
NAME_BYTES = 16
SNAPSHOT_HZ = 10  # of what each coordinator tells those who look on
CROWD = 30  # robots; of more, half as often, and not one by one


class WireError(MavherdError):
    """A payload on the bus that is not what its key promises."""


class Phase(IntEnum):
    """How far a vehicle is in its mission."""

    WAITING = 0  # no position or not ready to arm
    STARTING = 1  # arming, taking off
    READY = 2  # waiting for the others
    ACTIVE = 3  # on its path or on the way to its target
    DWELL = 4  # arrived, waiting there
    RETURNING = 5
    LANDING = 6
    DONE = 7


class VehicleState(NamedTuple):
    """One vehicle as its coordinator believes it to be; ENU relative to the fleet origin."""

    name: str
    system_id: int
    sequence: int  # the coordinator's tick
    time: float  # s of vehicle time at which position and velocity were true
    position: tuple[float, float, float]  # east, north, up, m
    velocity: tuple[float, float, float]  # m/s
    quaternion: tuple[float, float, float, float]  # w x y z, body FLU to ENU
    custom_mode: int
    armed: bool
    phase: Phase


class Target(NamedTuple):
    """What a coordinator asked of its vehicle, beside what it would have asked alone (ENU)."""

    name: str
    time: float
    nominal_position: tuple[float, float, float]
    nominal_velocity: tuple[float, float, float]
    command_velocity: tuple[float, float, float]
    feed_forward: tuple[float, float, float]  # velocity added by the coordination law, m/s


class Snapshot(NamedTuple):
    """What a coordinator believes of its vehicles and asks of them, at one moment."""

    sequence: int  # its tick
    now: float  # s of fleet time
    states: list[VehicleState]
    targets: list[Target]


_PHASES = tuple(Phase)
_STATE_FORM = f"HBBIdI{NAME_BYTES}sB11x10d"
_STATE = struct.Struct(f"<{_STATE_FORM}")
_TARGET_FORM = f"H6x{NAME_BYTES}s13d"
_TARGET = struct.Struct(f"<{_TARGET_FORM}")
_TEAM = struct.Struct("<HHI")
_SNAPSHOT = struct.Struct("<HHHxxId")


def pack_state(state: VehicleState) -> bytes:
    """Return the wire form of one state."""
    return _STATE.pack(*_flat(state))


def _flat(state: VehicleState) -> tuple[Any, ...]:
    name, system_id, sequence, time, position, velocity, quaternion, mode, armed, phase = state
    return (
        SCHEMA,
        system_id,
        armed,
        sequence,
        time,
        mode,
        name.encode(),
        phase,
        *position,
        *velocity,
        *quaternion,
    )


def unpack_state(data: bytes) -> VehicleState:
    """Return the state in `data`; raise WireError when it is not one."""
    if len(data) != _STATE.size:
        raise WireError(f"state: {len(data)} bytes where schema {SCHEMA} has {_STATE.size}")
    return _state_of(_STATE.unpack(data))


def _state_of(values: tuple[Any, ...]) -> VehicleState:
    schema, system_id, armed, sequence, time, mode, name, phase = values[:8]
    if schema != SCHEMA:
        raise WireError(f"state: schema {schema}, this program reads {SCHEMA}")
    if phase >= len(_PHASES):
        raise WireError(f"state: {phase} is not a valid Phase")
    return VehicleState(
        _text(name, "state"),
        system_id,
        sequence,
        time,
        values[8:11],
        values[11:14],
        values[14:18],
        mode,
        bool(armed),
        _PHASES[phase],
    )


def _text(name: bytes, what: str) -> str:
    try:
        return _decoded(name)
    except ValueError as error:
        raise WireError(f"{what}: {error}") from None


@lru_cache(maxsize=1024)
def _decoded(name: bytes) -> str:
    return name.rstrip(b"\0").decode()


def pack_team(sequence: int, states: Sequence[VehicleState]) -> bytes:
    """Return one message with all states of a tick."""
    values: list[Any] = [SCHEMA, len(states), sequence]
    for state in states:
        values += _flat(state)
    return _team_of(len(states)).pack(*values)


@cache
def _team_of(count: int) -> struct.Struct:
    return struct.Struct(_TEAM.format + count * _STATE_FORM)


def unpack_team(data: bytes) -> tuple[int, list[VehicleState]]:
    """Return the tick and the states in a team message; raise WireError when it is not one."""
    if len(data) < _TEAM.size:
        raise WireError(f"team: {len(data)} bytes, shorter than its header")
    schema, count, sequence = _TEAM.unpack_from(data)
    if schema != SCHEMA or len(data) != _TEAM.size + count * _STATE.size:
        raise WireError(f"team: schema {schema}, {count} states in {len(data)} bytes do not agree")
    return sequence, [_state_of(values) for values in _STATE.iter_unpack(data[_TEAM.size :])]


def pack_target(target: Target) -> bytes:
    """Return the wire form of one target."""
    return _TARGET.pack(*_flat_target(target))


def _flat_target(target: Target) -> tuple[Any, ...]:
    name, time, position, velocity, command, feed_forward = target
    return (SCHEMA, name.encode(), time, *position, *velocity, *command, *feed_forward)


def unpack_target(data: bytes) -> Target:
    """Return the target in `data`; raise WireError when it is not one."""
    if len(data) != _TARGET.size:
        raise WireError(f"target: {len(data)} bytes where schema {SCHEMA} has {_TARGET.size}")
    return _target_of(_TARGET.unpack(data))


def _target_of(values: tuple[Any, ...]) -> Target:
    schema, name, time = values[:3]
    if schema != SCHEMA:
        raise WireError(f"target: schema {schema}, this program reads {SCHEMA}")
    text = _text(name, "target")
    return Target(text, time, values[3:6], values[6:9], values[9:12], values[12:15])


def pack_snapshot(
    sequence: int, now: float, states: Sequence[VehicleState], targets: Sequence[Target]
) -> bytes:
    """Return one message with what a coordinator knows and asks in the tick at fleet time `now`."""
    values: list[Any] = [SCHEMA, len(states), len(targets), sequence, now]
    for state in states:
        values += _flat(state)
    for target in targets:
        values += _flat_target(target)
    return _snapshot_of(len(states), len(targets)).pack(*values)


@cache
def _snapshot_of(states: int, targets: int) -> struct.Struct:
    return struct.Struct(_SNAPSHOT.format + states * _STATE_FORM + targets * _TARGET_FORM)


def unpack_snapshot(data: bytes) -> Snapshot:
    """Return the snapshot in `data`; raise WireError when it is not one."""
    if len(data) < _SNAPSHOT.size:
        raise WireError(f"snapshot: {len(data)} bytes, shorter than its header")
    schema, states, targets, sequence, now = _SNAPSHOT.unpack_from(data)
    middle = _SNAPSHOT.size + states * _STATE.size
    if schema != SCHEMA or len(data) != middle + targets * _TARGET.size:
        told = f"{states} states and {targets} targets"
        raise WireError(f"snapshot: schema {schema}, {told} in {len(data)} bytes do not agree")
    return Snapshot(
        sequence,
        now,
        [_state_of(v) for v in _STATE.iter_unpack(data[_SNAPSHOT.size : middle])],
        [_target_of(v) for v in _TARGET.iter_unpack(data[middle:])],
    )
