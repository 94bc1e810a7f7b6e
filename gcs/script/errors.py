"""What a script may want to catch. Every text names the vehicle, what was asked and the cure."""

from ...transport.errors import MavherdError


class FleetError(MavherdError):
    """Something that a script asked of its fleet cannot be had."""

    exit_code = 3


class Refused(FleetError):  # noqa: N818 - reads as what has happened
    """A vehicle will not or cannot do it; the text repeats its reason."""


class TimedOut(FleetError):  # noqa: N818 - as above
    """It was not done within the time allowed, in the vehicle's own time."""


class LinkLost(FleetError):  # noqa: N818 - as above
    """Nothing is heard of a vehicle any more."""


class TakenOver(FleetError):  # noqa: N818 - as above
    """The vehicle has left the mode in which it follows the script: a pilot, or its failsafe."""
