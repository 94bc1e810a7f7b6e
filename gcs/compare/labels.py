"""What runs are called when they stand side by side: by what differs between them."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

MAX_KEYS = 3  # in a label; runs that differ in more go by their folder's name
MAX_COLOURS = 8  # that can be told apart; of more runs, those of one group share theirs
_FIRST = "name", "team.law", "seed"
_LAST = "description", "expect.", "robots."


def differing(settings: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the keys that not all runs have alike: what matters most first."""
    keys = dict.fromkeys(key for run in settings for key in run)
    found = [k for k in keys if any(run.get(k) != settings[0].get(k) for run in settings)]
    order = {key: place for place, key in enumerate(_FIRST)}
    return sorted(found, key=lambda key: (order.get(key, len(order)), place(key)))


def labels(settings: Sequence[Mapping[str, Any]], folders: Sequence[Path]) -> list[str]:
    """Return a name for each run, no two alike: `law=safe`, or its folder's name.

    Runs of the same settings are told apart by the end of their folders' names.
    """
    chosen = _telling(settings)
    if len(chosen) > MAX_KEYS:
        return _unlike([folder.resolve().name for folder in folders], folders)
    named = [", ".join(_said(run, chosen)) for run in settings]
    return _unlike(named, folders)


def groups(settings: Sequence[Mapping[str, Any]], labels: Sequence[str]) -> list[str]:
    """Return what is said of each run's colour: its own label or, of many, what matters most.

    Of twenty runs by two laws and ten seeds that is the law.
    """
    if len(labels) > MAX_COLOURS:
        for key in differing(settings):
            said = [next(_said(run, [key])) for run in settings]
            if 1 < len(set(said)) <= MAX_COLOURS:
                return said
    return list(labels)


def place(key: str) -> int:
    """Return how far behind a key comes; 0 for those that are of the run as a whole."""
    return next((n for n, start in enumerate(_LAST, 1) if key.startswith(start)), 0)


def _telling(settings: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return as few keys as tell apart all runs that settings can tell apart."""
    chosen: list[str] = []
    groups = 1
    for key in differing(settings):
        if key == "description":
            continue
        more = len({_values(run, [*chosen, key]) for run in settings})
        if more > groups:
            chosen, groups = [*chosen, key], more
    return chosen


def _values(run: Mapping[str, Any], keys: Sequence[str]) -> tuple[str, ...]:
    return tuple(repr(run.get(key)) for key in keys)


def _said(run: Mapping[str, Any], keys: Sequence[str]) -> Iterator[str]:
    short = Counter(key.rpartition(".")[2] for key in keys)
    for key in keys:
        last = key.rpartition(".")[2]
        value = run.get(key, "default")
        yield str(value) if key == "name" else f"{last if short[last] == 1 else key}={value}"


def _unlike(named: Sequence[str], folders: Sequence[Path]) -> list[str]:
    """Return the names, with more of its folder where two are the same."""
    many = Counter(named)
    tails = [folder.resolve().name.rpartition("-")[2] for folder in folders]
    several = [
        f"{name} ({tail})" if name and many[name] > 1 else name or tail
        for name, tail in zip(named, tails, strict=True)
    ]
    again = Counter(several)
    seen: Counter[str] = Counter()
    out = []
    for name in several:  # copies of one folder in different places
        seen[name] += 1
        out.append(f"{name} {seen[name]}" if again[name] > 1 else name)
    return out
