"""Robots that somebody else has started: where they are, and what cannot be asked of them."""

from collections.abc import Iterable

from ..transport.connect import parse_connect
from ..transport.errors import LinkError
from ..vehicles.config import AUTOPILOTS
from .reader import Fields
from .schema import RobotSpec, Team

MIN_RATE_HZ = 10.0  # of setpoints, for real autopilots: PX4 drops out below 2 Hz, rovers meander

_SIMULATED = ("profile", "params", "disturbance")


def read_connect(fields: Fields) -> str | None:
    """Return the address of an external vehicle, None for a robot of our own."""
    if fields.raw("connect") is None:
        return None
    address = fields.text("connect")
    try:
        parse_connect(address)
    except LinkError as error:
        raise fields.error("connect", str(error).removeprefix("connect ")) from None
    for key in _SIMULATED:
        if fields.raw(key) is not None:
            raise fields.error(
                key,
                "cannot be given to a vehicle with `connect`, which mavherd does not simulate",
                "remove it here and set it on the vehicle",
            )
    return address


def read_autopilot(fields: Fields, default: str) -> str:
    """Return the flight stack; `default` is that of our own robots, and `auto` of the others."""
    if fields.raw("connect") is not None:
        return fields.choice("autopilot", ("ardupilot", "px4", "auto"), "auto")
    if fields.raw("autopilot") == "auto":
        raise fields.error(
            "autopilot",
            "'auto' asks a vehicle what it is, and this one is ours to choose",
            f"one of: {', '.join(AUTOPILOTS)}; or give `connect` for an external vehicle",
        )
    return fields.choice("autopilot", AUTOPILOTS, default)


def check_external(read: Iterable[tuple[RobotSpec, Fields]], team: Team) -> None:
    """Refuse addresses that two robots cannot share, and setpoints too slow for real autopilots."""
    first: dict[object, tuple[RobotSpec, Fields]] = {}
    for spec, fields in read:
        if spec.connect is None:
            continue
        if team.rate_hz < MIN_RATE_HZ:
            raise fields.error(
                "connect",
                f"team.rate_hz is {team.rate_hz:g}, too slow to steer a real autopilot",
                f"set it to {MIN_RATE_HZ:g} or more",
            )
        address = parse_connect(spec.connect)
        place = address.device or (address.scheme, address.host, address.port)
        other, others = first.setdefault(place, (spec, fields))
        told_apart = fields.raw("system_id") is not None and others.raw("system_id") is not None
        told_apart = told_apart and parse_connect(other.connect or "") == address  # baud rate, too
        if other is not spec and address.scheme != "udpin" and not told_apart:
            raise fields.error(
                "connect",
                f"{spec.connect} is already the address of {other.name!r}",
                "one vehicle answers there, unless it is a router: then give both a `system_id`",
            )
