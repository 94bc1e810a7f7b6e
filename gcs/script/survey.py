"""Finds out who is behind addresses, and where they stand, before a fleet is made of them."""

import select
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...scenarios.schema import Expect, Fence, Hold, Point, RobotSpec, Scenario, Team
from ...transport.connect import parse_connect
from ...transport.frames import Origin, swap_yaw
from ...transport.hail import hail
from ...transport.switchboard import Found, Switchboard
from ..station import Station
from ..station.identity import kind_heard, type_name
from .errors import FleetError

HAIL_S = 2.5  # vehicles send a heartbeat every second
_AGAIN_S = 0.5
NAMES = {"quadcopter": "quad", "rover": "rover"}
_LOOK_S = 0.05
_RATE_HZ = 10.0  # of telemetry, to look at


@dataclass(frozen=True, slots=True)
class Known:
    """A vehicle that was found, and what it tells of itself."""

    found: Found
    kind: str
    station: Station

    @property
    def is_placed(self) -> bool:
        """Whether it has told where it is, and where its own frame begins."""
        status = self.station.status
        return status.global_position is not None and status.origin is not None


def survey(
    addresses: Sequence[str], *, expect: int | None, timeout: float
) -> tuple[Switchboard, dict[str, Known]]:
    """Return the open lines, and by name all vehicles behind the addresses.

    Waits until one is heard at each address (or `expect` in all) and until all have told where
    they are; raises FleetError when that takes longer than `timeout` seconds.
    """
    if not addresses:
        raise FleetError("connect: no address (as in Fleet.connect('udpin:127.0.0.1:14550'))")
    places = [parse_connect(text) for text in addresses]
    deadline = time.monotonic() + timeout
    board, found = hail(places, min(HAIL_S, timeout))
    try:
        while not found or _is_lacking(board, found, expect):
            if time.monotonic() > deadline:
                heard = f"{len(found)} vehicle{'s' * (len(found) != 1)} heard within {timeout:g} s"
                wanted = f", of {expect}" if expect else ""
                raise FleetError("; ".join([f"connect: {heard}{wanted}", *board.silences()]))
            _, found = hail((), _AGAIN_S, board)
        known = _named(found)
        for name, one in known.items():
            board.want(name, one.found.address, one.found.system_id)
        _ask(board, known, deadline, timeout)
    except BaseException:
        board.close()
        raise
    return board, known


def team_of(
    known: Mapping[str, Known],
    *,
    origin: Origin | None,
    fence: Fence | None,
    law: str,
    timeout: float,
) -> Scenario:
    """Return the scenario of the vehicles that were found, each where it stands.

    Without an `origin`, the fleet's is where the first vehicle's own frame begins.
    """
    first = next(iter(known.values())).station.status.origin
    origin = origin or first or Origin()
    return Scenario(
        name="connected",
        robots=tuple(_spec(name, one, origin) for name, one in known.items()),
        origin=origin,
        team=Team(law=law, ready_timeout_s=timeout),
        expect=Expect(collisions=0),
        fence=fence,
    )


def _is_lacking(board: Switchboard, found: Sequence[Found], expect: int | None) -> bool:
    """Return whether there must be more: so many in all, or somebody at each address."""
    return bool(board.silences()) if expect is None else len(found) < expect


def _named(found: Sequence[Found]) -> dict[str, Known]:
    """Return the vehicles that we can fly, named by kind in order of system id."""
    count = dict.fromkeys(NAMES, 0)
    known: dict[str, Known] = {}
    seen: dict[int, Found] = {}
    for one in sorted(found, key=lambda f: f.system_id):
        where = f"system {one.system_id} at {one.address.text}"
        kind = kind_heard(one.mav_type)
        if kind is None:
            raise FleetError(
                f"connect: {where} is a {type_name(one.mav_type)}; "
                f"mavherd flies multicopters and drives rovers"
            )
        if other := seen.get(one.system_id):
            raise FleetError(
                f"connect: {where} and the one at {other.address.text} ({one.source}, "
                f"{other.source}) have the same system id "
                "(give each its own: SYSID_THISMAV or MAV_SYS_ID)"
            )
        seen[one.system_id] = one
        count[kind] += 1
        name = f"{NAMES[kind]}{count[kind]}"
        station = Station(name, one.system_id, _RATE_HZ, kind=kind, stack=None, origin=Origin())
        known[name] = Known(one, kind, station)
    return known


def _ask(board: Switchboard, known: Mapping[str, Known], deadline: float, timeout: float) -> None:
    """Ask all vehicles where they are until they have told."""
    begun = time.monotonic()
    while waiting := [name for name, one in known.items() if not one.is_placed]:
        select.select(board.sockets(), [], [], _LOOK_S)
        now = time.monotonic() - begun
        for name, frames in board.receive():
            known[name].station.receive(frames, now)
        for name, one in known.items():
            if data := one.station.transmit(now):
                board.send(name, data)
        if time.monotonic() > deadline:
            said = "; ".join(
                text
                for name in waiting
                for _, _, text in list(known[name].station.status.texts)[-2:]
            )
            raise FleetError(
                f"connect: {', '.join(waiting)}: no position within {timeout:g} s"
                + (f": the vehicle says {said!r}" if said else "")
                + " (ArduPilot's estimate takes about 20 s after boot; timeout=... allows more)"
            )


def _spec(name: str, one: Known, origin: Origin) -> RobotSpec:
    status = one.station.status
    lat_deg, lon_deg, _ = status.global_position or (origin.lat_deg, origin.lon_deg, 0.0)
    north, east = origin.from_geodetic(lat_deg, lon_deg)
    start = Point(east, north)
    return RobotSpec(
        name=name,
        kind=one.kind,
        system_id=one.found.system_id,
        start=start,
        heading=swap_yaw(status.yaw),
        path=Hold(at=start),
        autopilot="auto",
        connect=one.found.address.text,
    )
