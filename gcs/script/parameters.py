"""A vehicle's parameters as a script sees them: `quad.param["WPNAV_SPEED"] = 300`."""

from collections.abc import Callable

from ..station import Station
from ..station.question import Question

Ask = Callable[[str, Callable[[float], Question]], Question]
"""Asks a question at fleet time and waits for the answer; the text says what was asked."""


class ParamValues:
    """Reads and writes single parameters by name, over the link, each time anew."""

    def __init__(self, station: Station, ask: Ask) -> None:
        self._parameters = station.parameters
        self._ask = ask

    def __getitem__(self, name: str) -> float:
        """Return the value the vehicle has now; raise Refused when it has none of that name."""
        question = self._ask(f"read {name}", lambda now: self._parameters.read(name, now))
        assert question.value is not None  # noqa: S101 - it was answered
        return question.value

    def __setitem__(self, name: str, value: float) -> None:
        """Set it, and wait until the vehicle confirms; raise Refused when it does not.

        An integer is not sent a fraction, nor a number that does not fit: it stays as it is.
        """
        self._ask(f"set {name} to {value:g}", lambda now: self._parameters.write(name, value, now))
