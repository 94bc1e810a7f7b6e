"""From YAML text to a tree of plain values that know their line. The only module that reads YAML.

Scalars follow YAML 1.2: `off` is a word, `010` is ten and `1e-3` is a number. What a hostile file
can size is bounded: bytes, depth, and the number of values after aliases are expanded.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import yaml

from .errors import ScenarioError, show

MAX_BYTES = 1_000_000
MAX_DEPTH = 16
MAX_VALUES = 100_000

_TAG = "tag:yaml.org,2002:"
_MERGE = _TAG + "merge"


@dataclass(slots=True)
class Node:
    """One value of a scenario file and where it is written: `file:line` or the override."""

    value: "bool | int | float | str | list[Node] | dict[str, Node] | None"
    where: str


def read_text(path: Path, if_missing: str = "") -> str:
    """Return the text of a scenario file; `if_missing` is a hint for when there is none."""
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        reason = error.strerror if isinstance(error, OSError) else str(error)
        hint = if_missing if isinstance(error, FileNotFoundError) else ""
        raise ScenarioError(str(path), f"cannot read this file: {reason}", hint) from None
    if len(data) > MAX_BYTES:
        raise _too_long(str(path))
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ScenarioError(str(path), f"not UTF-8 text (byte {error.start})") from None


def parse(text: str, name: str, *, lines: bool = True) -> Node:
    """Return the tree of one YAML document; errors carry `name` and, unless told not to, lines."""
    if len(text) > MAX_BYTES:
        raise _too_long(name)
    try:
        root = yaml.compose(text, Loader=Loader)
        return Node(None, name) if root is None else _Tree(name, lines).convert(root)
    except RecursionError:
        raise ScenarioError(name, f"nested more than {MAX_DEPTH} deep") from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        spot = f":{mark.line + 1}:{mark.column + 1}" if mark and lines else ""
        problem = error.problem or error.context or "syntax error"
        if problem.startswith("but ") and error.context:
            problem = f"{error.context}, {problem}"
        hint = next((cure for sign, cure in _CURES.items() if sign in problem), "")
        raise ScenarioError(name + spot, f"not YAML: {problem}", hint) from None
    except yaml.YAMLError as error:
        position = getattr(error, "position", 0)
        spot = f":{text.count(chr(10), 0, position) + 1}" if lines else ""
        raise ScenarioError(name + spot, "a character that YAML does not allow") from None
    except ValueError as error:  # the scanner's own, such as an escape beyond Unicode
        raise ScenarioError(name, f"not YAML: {error}") from None


_CURES = {
    "'\\t'": "indent with spaces, not tabs",
    "block end": "check the indentation of this line and those before",
    "mapping values": "one 'key: value' a line; text that holds ': ' needs quotes",
    "flow": "check that every { and [ is closed and its entries have commas between",
    "another document": "keep what is before or after the '---'",
}


def _too_long(name: str) -> ScenarioError:
    return ScenarioError(name, f"longer than {MAX_BYTES} bytes, which no scenario needs")


class Loader(yaml.SafeLoader):
    """PyYAML's composer with the scalars of YAML 1.2."""

    yaml_implicit_resolvers = {}  # noqa: RUF012 - PyYAML's own way to say so


CORE_SCALARS = (
    ("null", r"~|null|Null|NULL|", ("~", "n", "N", "")),
    ("bool", r"true|True|TRUE|false|False|FALSE", tuple("tTfF")),
    ("int", r"[-+]?[0-9]+", tuple("-+0123456789")),
    (
        "float",
        r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
        tuple("-+0123456789."),
    ),
    ("merge", r"<<", ("<",)),
)
for _kind, _pattern, _first in CORE_SCALARS:
    Loader.add_implicit_resolver(_TAG + _kind, re.compile(f"(?:{_pattern})$"), list(_first))


class _Tree:
    """Copies PyYAML's graph into a tree of `Node`s, within the bounds."""

    def __init__(self, name: str, lines: bool) -> None:
        self.name = name
        self.lines = lines
        self.values = 0

    def convert(self, node: yaml.Node, where: str | None = None, depth: int = 0) -> Node:
        where = where or self._where(node)
        self.values += 1
        if depth > MAX_DEPTH:
            raise ScenarioError(where, f"nested more than {MAX_DEPTH} deep")
        if self.values > MAX_VALUES:
            raise ScenarioError(where, f"more than {MAX_VALUES} values, aliases counted in full")
        match node:
            case yaml.MappingNode(tag=tag) if tag == _TAG + "map":
                return Node(self._mapping(node, depth), where)
            case yaml.SequenceNode(tag=tag) if tag == _TAG + "seq":
                return Node([self.convert(item, None, depth + 1) for item in node.value], where)
            case yaml.ScalarNode():
                return Node(_scalar(node, where), where)
        raise ScenarioError(where, f"unknown tag {show(node.tag)}", "write plain values")

    def _where(self, node: yaml.Node) -> str:
        return f"{self.name}:{node.start_mark.line + 1}" if self.lines else self.name

    def _mapping(self, node: yaml.MappingNode, depth: int) -> dict[str, Node]:
        own: dict[str, Node] = {}
        merged: dict[str, Node] = {}
        for key, value in node.value:
            where = self._where(key)
            if not isinstance(key, yaml.ScalarNode):
                raise ScenarioError(where, "a key must be a word", "not a list or a mapping")
            if key.tag == _MERGE:
                for name, inherited in self._merge(value, where, depth).items():
                    merged.setdefault(name, inherited)
            elif key.value in own:
                raise ScenarioError(where, f"duplicate key {show(key.value)}", "keep one of them")
            else:
                own[key.value] = self.convert(value, where, depth + 1)
        return merged | own

    def _merge(self, value: yaml.Node, where: str, depth: int) -> dict[str, Node]:
        tree = self.convert(value, where, depth + 1).value
        found: dict[str, Node] = {}
        for part in tree if isinstance(tree, list) else [Node(tree, where)]:
            if not isinstance(part.value, dict):
                raise ScenarioError(where, "'<<' must name a mapping", "as in '<<: *base'")
            found = part.value | found
        return found


def _scalar(node: yaml.ScalarNode, where: str) -> bool | int | float | str | None:
    text = str(node.value)
    try:
        match node.tag.removeprefix(_TAG):
            case "null":
                return None
            case "bool":
                return {"true": True, "false": False}[text.lower()]
            case "int":
                return int(text) if len(text) < 20 else float(text)
            case "float":
                return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
            case "str" | "merge":
                return text
    except (ValueError, KeyError):
        raise ScenarioError(where, f"{show(text)} is not {node.tag.removeprefix(_TAG)}") from None
    raise ScenarioError(where, f"unknown tag {show(node.tag)}", "write plain values")
