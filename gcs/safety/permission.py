"""What somebody must have said before vehicles that may be real ones are flown."""

from collections.abc import Mapping

from ...scenarios.schema import Fence, Scenario
from ...transport.connect import parse_connect
from ...transport.errors import MavherdError

_FENCE = "fence: {east: [-20, 20], north: [-20, 20], up: 10}"


def permit(addresses: Mapping[str, str], fence: Fence | None, confirmed: str | None) -> None:
    """Raise MavherdError if vehicles beyond this machine are to be flown without leave and fence.

    `addresses` are those of external vehicles, by name; `confirmed` is how leave is given, such as
    "--confirm", or None when it has been given.
    """
    real = {n: text for n, text in addresses.items() if not parse_connect(text).loopback}
    wanted = [f"say {confirmed}"] if confirmed else []
    if fence is None:
        wanted.append(f"give the fence that they must not leave, as in `{_FENCE}`")
    if not real or not wanted:
        return
    who = ", ".join(f"{name} ({text})" for name, text in real.items())
    raise MavherdError(
        f"{who}: not on this machine's loopback, so it may be a real vehicle and hurt somebody"
        f" ({' and '.join(wanted)})"
    )


def external(scenario: Scenario) -> dict[str, str]:
    """Return the addresses of a scenario's external vehicles by name."""
    return {spec.name: spec.connect for spec in scenario.robots if spec.connect is not None}
