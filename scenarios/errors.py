"""The error of a scenario, and the words it is made of."""

from collections.abc import Iterable
from difflib import get_close_matches

from ..transport.errors import MavherdError


class ScenarioError(MavherdError):
    """A scenario that cannot be run. The text names file, line or key, the problem and the cure."""

    def __init__(self, where: str, problem: str, hint: str = "") -> None:
        super().__init__(f"{where}: {problem}" + (f" ({hint})" if hint else ""))


def show(value: object) -> str:
    """Return `value` as an error quotes it: printable and short, whatever it holds."""
    if isinstance(value, list):
        return "a list"
    if isinstance(value, dict):
        return "a mapping"
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def did_you_mean(word: str, known: Iterable[str], what: str = "known") -> str:
    """Return the hint for a misspelt `word`: the nearest known one, else all of them."""
    names = list(known)
    if near := get_close_matches(word[:60], names, n=1):
        return f"did you mean {near[0]!r}?"
    return f"{what}: {', '.join(names)}" if names else f"{what}: none"
