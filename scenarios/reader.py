"""Typed look-ups in one mapping of a scenario; every complaint names line, key and cure."""

import re
from collections.abc import Iterable, Iterator, Sequence
from math import inf, isfinite

from .errors import ScenarioError, did_you_mean, show
from .source import Node

FAR = 10_000.0  # m, the farthest a position may be from the origin
LONG = 86_400.0  # s, the longest time anything may take

WORD_HINT = "letters, digits, '-' and '_'"
_WORD = re.compile(r"[A-Za-z0-9_-]{1,64}", re.ASCII)


class Fields:
    """One mapping of a scenario. A key without a value (`team:`) counts as not given."""

    def __init__(self, node: Node, path: str, known: Iterable[str] | None) -> None:
        self.path = path
        self.where = node.where
        if not isinstance(node.value, dict):
            raise ScenarioError(
                self._at(node.where, ""),
                f"must be a mapping, got {show(node.value)}",
                f"keys: {', '.join(known)}" if known else "",
            )
        self._items = node.value
        self.known = tuple(self._items if known is None else known)  # None: any key
        for key, item in self._items.items():
            if known is None and not _WORD.fullmatch(key):
                raise ScenarioError(self._at(item.where, ""), f"{show(key)} is no name", WORD_HINT)
            if key not in self.known:
                raise ScenarioError(
                    self._at(item.where, ""),
                    f"unknown key {show(key)}",
                    did_you_mean(key, self.known, "keys"),
                )

    def error(self, key: str, problem: str, hint: str = "") -> ScenarioError:
        """Return the error for `key`, naming its place."""
        return ScenarioError(self.place(key), problem, hint)

    def place(self, key: str) -> str:
        """Return the line where `key` or, failing that, its mapping is, and its path."""
        node = self._items.get(key)
        return self._at(node.where if node else self.where, key)

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def number(
        self, key: str, default: float | None = None, *, low: float = -FAR, high: float = FAR
    ) -> float:
        """Return a finite number within low..high."""
        value = self._value(key, default)
        if isinstance(value, bool) or not isinstance(value, int | float):
            hint = "remove the quotes" if isinstance(value, str) and _is_number(value) else ""
            raise self.error(key, f"must be a number, got {show(value)}", hint)
        if not isfinite(value):
            raise self.error(key, f"must be a finite number, got {value}")
        if not low <= value <= high:
            raise self.error(key, f"must be {low:g}..{high:g}, got {value:g}")
        return float(value)

    def positive(self, key: str, default: float | None = None, *, high: float = FAR) -> float:
        """Return a number above zero; the smallest is a thousandth."""
        value = self.number(key, default, low=-inf, high=inf)
        if not value > 0:
            raise self.error(key, f"must be positive, got {value:g}")
        return self.number(key, default, low=1e-3, high=high)

    def integer(self, key: str, default: int | None = None, *, low: int, high: int) -> int:
        """Return a whole number within low..high."""
        value = self._value(key, default)
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.error(key, f"must be a whole number, got {show(value)}")
        if not low <= value <= high:
            raise self.error(key, f"must be {low}..{high}, got {value}")
        return value

    def flag(self, key: str, default: bool) -> bool:
        """Return true or false."""
        value = self._value(key, default)
        if not isinstance(value, bool):
            raise self.error(key, f"must be true or false, got {show(value)}")
        return value

    def text(self, key: str, default: str | None = None) -> str:
        """Return printable text."""
        value = self._value(key, default)
        if not isinstance(value, str):
            hint = "put it in quotes" if isinstance(value, int | float) else ""
            raise self.error(key, f"must be text, got {show(value)}", hint)
        if len(value) > 2000 or not value.replace("\n", " ").isprintable():
            raise self.error(key, f"must be printable text of at most 2000 letters: {show(value)}")
        return value

    def choice(self, key: str, allowed: Sequence[str], default: str | None = None) -> str:
        """Return one of the words `allowed`."""
        value = self._value(key, default)
        if not isinstance(value, str) or value not in allowed:
            raise self.error(
                key, f"unknown {key} {show(value)}", did_you_mean(str(value), allowed, "one of")
            )
        return value

    def interval(self, key: str) -> tuple[float, float]:
        """Return the two numbers of a list, the lower one first."""
        ends = self.items(key)
        if len(ends) != 2:
            raise self.error(key, f"must be two numbers, got {len(ends)}", "as in [-20, 20]")
        tree: dict[str, Node] = {str(i): node for i, (_, node) in enumerate(ends)}
        pair = Fields(Node(tree, self.where), self._join(key), None)
        low, high = pair.number("0"), pair.number("1")
        if not low < high:
            raise self.error(key, f"must rise, got {low:g} to {high:g}", "the lower end first")
        return (low, high)

    def mapping(self, key: str, known: Iterable[str] | None, *, required: bool = False) -> "Fields":
        """Return the mapping under `key`, empty when it is not given and not required."""
        node = self._items.get(key)
        if node is None or node.value is None:
            if required:
                raise self.error(key, "is missing", f"keys: {', '.join(known or ())}")
            node = Node({}, node.where if node else self.where)
        return Fields(node, self._join(key), known)

    def items(self, key: str) -> list[tuple[str, Node]]:
        """Return the entries of the list under `key`, each with its path."""
        value = self._value(key, None)
        if not isinstance(value, list):
            raise self.error(
                key, f"must be a list, got {show(value)}", "each entry starts with '-'"
            )
        return [(f"{self._join(key)}[{i}]", node) for i, node in enumerate(value)]

    def raw(self, key: str) -> object:
        """Return the bare value under `key`, None when it is not given."""
        return self._value(key, default=None, required=False)

    def _value(self, key: str, default: object, *, required: bool = True) -> object:
        node = self._items.get(key)
        value = default if node is None or node.value is None else node.value
        if value is None and required:
            raise self.error(key, "is missing")
        return value

    def _join(self, key: str) -> str:
        return f"{self.path}.{key}" if self.path else key

    def _at(self, where: str, key: str) -> str:
        path = self._join(key) if key else self.path
        return f"{where}: {path}" if path else where


def _is_number(text: str) -> bool:
    try:
        return isfinite(float(text))
    except ValueError:
        return False
