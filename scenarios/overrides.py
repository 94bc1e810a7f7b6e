"""`--set key=value`: changes to a raw scenario, checked with it; errors name the override."""

from .errors import ScenarioError, did_you_mean, show
from .source import Node, parse


def override(root: Node, text: str, *, last: bool, option: str = "--set") -> bool:
    """Set one `key=value` in the tree; return False if it names a robot that is not there.

    A robot made by `count` appears later, so that only the `last` attempt raises ScenarioError.
    """
    path, equals, value = text.partition("=")
    said = text if option == "--set" else value
    where = f"{option} {said if said.isprintable() else show(said)}"
    keys = path.replace("[", ".").replace("]", "").strip().split(".")
    if not equals or not all(keys):
        raise ScenarioError(where, "not of the form key=value", "as in team.law=paper")
    here = root
    for depth, key in enumerate(keys[:-1]):
        child = _child(here, key, where)
        if child is None:
            if not last and keys[0] == "robots" and depth == 1:
                return False
            raise _no_item(here, key, ".".join(keys[:depth]), where)
        if key == "disturbance" and isinstance(child.value, str):
            child.value = {"form": Node(child.value, child.where)}  # its short form
        here = child
    _assign(here, keys, parse(value, where, lines=False), where)
    return True


def _assign(here: Node, keys: list[str], new: Node, where: str) -> None:
    """Put `new` under the last of `keys`, in the mapping or list that the others lead to."""
    path, key = ".".join(keys[:-1]), keys[-1]
    if isinstance(here.value, list):
        old = _child(here, key, where)
        if old is None:
            raise _no_item(here, key, path, where)
        old.value, old.where = new.value, new.where
    elif isinstance(here.value, dict):
        here.value[key] = new
    elif here.value is None:
        here.value = {key: new}
    else:
        raise ScenarioError(where, f"{path or 'the file'} is {show(here.value)}, not a mapping")


def _child(here: Node, key: str, where: str) -> Node | None:
    """Return what `key` names in a mapping (made if need be) or list (by name or index)."""
    if here.value is None:
        here.value = {}
    if isinstance(here.value, dict):
        return here.value.setdefault(key, Node(None, where))
    if not isinstance(here.value, list):
        raise ScenarioError(where, f"{show(here.value)} has no {show(key)}")
    if key in (names := _names(here.value)):
        return here.value[names.index(key)]
    is_index = key.isascii() and key.isdigit() and len(key) < 6
    return here.value[int(key)] if is_index and int(key) < len(here.value) else None


def _names(entries: list[Node]) -> list[str]:
    """Return the names of a list's entries, empty for those without."""
    named = [e.value.get("name") if isinstance(e.value, dict) else None for e in entries]
    return [str(name.value) if name else "" for name in named]


def _no_item(here: Node, key: str, path: str, where: str) -> ScenarioError:
    names = _names(here.value) if isinstance(here.value, list) else []
    known = [name for name in names if name.isprintable() and name]
    return ScenarioError(
        where, f"{path or 'the file'} has no {show(key)}", did_you_mean(key, known, "there are")
    )
