"""What becomes of external vehicles whose coordinator was killed, and who can help. No I/O."""

from collections.abc import Sequence

from ...scenarios.schema import RobotSpec
from ...transport.wire import Phase

_AT_REST = (Phase.WAITING.name.lower(), Phase.DONE.name.lower())
_FATES = {
    "ardupilot": "ArduPilot stops after 3 s (GUID_TIMEOUT) and stays there, armed, in GUIDED",
    "px4": "PX4 fails safe after 1 s (COM_OF_LOSS_T): returns, lands, or as COM_OBL_RC_ACT says",
}


def may_be_armed(phase: str | None) -> bool:
    """Return whether a vehicle was under way, by the last phase that was told of it."""
    return phase is not None and phase not in _AT_REST


def fate(spec: RobotSpec) -> str:
    """Return the event that tells of one vehicle."""
    return f"nobody steers it any more, it may be armed: {_by_itself([spec])}"


def complaint(specs: Sequence[RobotSpec]) -> str:
    """Return what the user is told of all of them; "" without any."""
    if not specs:
        return ""
    names = ", ".join(spec.name for spec in specs)
    flies = any(spec.kind == "quadcopter" for spec in specs)
    drives = any(spec.kind == "rover" for spec in specs)
    ways = ["`mode LAND`"] * flies + ["`mode HOLD` and `disarm`"] * drives
    return (
        f"nobody steers {names} any more, may be {'flying, ' if flies else ''}armed "
        f"({_by_itself(specs)}): take over with a transmitter or a ground station "
        f"(MAVProxy: {', rovers '.join(ways)})"
    )


def _by_itself(specs: Sequence[RobotSpec]) -> str:
    """Return what they do without set-points, once for each flight stack."""
    stacks = {spec.autopilot for spec in specs}
    return "; ".join(text for name, text in _FATES.items() if stacks & {name, "auto"})
