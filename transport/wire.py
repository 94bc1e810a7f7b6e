"""What travels on Zenoh: fixed-size structs in ENU, SI, little-endian. See docs/zenoh.md.

Keys live under `mavherd/<run>/`: `vehicle/<name>/state`, `vehicle/<name>/target`,
`vehicle/<name>/alive` (liveliness token), `team`, `events`, `clock`.
"""

import struct
from collections.abc import Sequence
from enum import IntEnum
from functools import cache
from typing import Any, NamedTuple

from .errors import MavherdError

SCHEMA = 1
NAME_BYTES = 16


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


_STATE_FORM = f"HBBIdI{NAME_BYTES}sB11x10d"
_STATE = struct.Struct(f"<{_STATE_FORM}")
_TARGET = struct.Struct(f"<H6x{NAME_BYTES}s13d")
_TEAM = struct.Struct("<HHI")


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
    schema, system_id, armed, sequence, time, mode, name, phase, *v = _STATE.unpack(data)
    if schema != SCHEMA:
        raise WireError(f"state: schema {schema}, this program reads {SCHEMA}")
    try:
        text, stage = name.rstrip(b"\0").decode(), Phase(phase)
    except ValueError as error:
        raise WireError(f"state: {error}") from None
    return VehicleState(
        text,
        system_id,
        sequence,
        time,
        (v[0], v[1], v[2]),
        (v[3], v[4], v[5]),
        (v[6], v[7], v[8], v[9]),
        mode,
        bool(armed),
        stage,
    )


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
    starts = range(_TEAM.size, len(data), _STATE.size)
    return sequence, [unpack_state(data[i : i + _STATE.size]) for i in starts]


def pack_target(target: Target) -> bytes:
    """Return the wire form of one target."""
    return _TARGET.pack(
        SCHEMA,
        target.name.encode(),
        target.time,
        *target.nominal_position,
        *target.nominal_velocity,
        *target.command_velocity,
        *target.feed_forward,
    )


def unpack_target(data: bytes) -> Target:
    """Return the target in `data`; raise WireError when it is not one."""
    if len(data) != _TARGET.size:
        raise WireError(f"target: {len(data)} bytes where schema {SCHEMA} has {_TARGET.size}")
    schema, name, time, *v = _TARGET.unpack(data)
    if schema != SCHEMA:
        raise WireError(f"target: schema {schema}, this program reads {SCHEMA}")
    try:
        text = name.rstrip(b"\0").decode()
    except ValueError as error:
        raise WireError(f"target: {error}") from None
    return Target(
        text, time, (v[0], v[1], v[2]), (v[3], v[4], v[5]), (v[6], v[7], v[8]), (v[9], v[10], v[11])
    )
