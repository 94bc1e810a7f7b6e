"""What a sweep varies, as typed: `--set KEY=V1,V2` and `--seeds 0:200,500`."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ...scenarios.loader import MAX_SEED
from ...transport.errors import MavherdError

MAX_RUNS = 1_000_000
MAX_POINTS = 10_000
OPEN, CLOSE = "[{", "]}"


class Axis(NamedTuple):
    """One key of the scenario and the values that it takes in turn, in YAML."""

    key: str
    values: tuple[str, ...]


def read_sets(texts: Sequence[str]) -> tuple[tuple[str, ...], tuple[Axis, ...]]:
    """Return what is set to one value for all runs, and what is varied, in the order given.

    A comma parts values unless brackets, braces or quotes hold it: `[-20, 20]` is one value.
    """
    fixed: list[str] = []
    grid: list[Axis] = []
    seen: set[str] = set()
    for text in texts:
        key, equals, values = text.partition("=")
        key = key.strip()
        where = f"--set {text}"
        if not equals or not key:
            raise MavherdError(f"{where}: not of the form KEY=V1,V2 (as in team.law=paper,safe)")
        if key == "seed":
            raise MavherdError(f"{where}: seeds have an option of their own (--seeds 0:200)")
        if key in seen:
            raise MavherdError(f"{where}: {key} is set twice (give all its values in one --set)")
        seen.add(key)
        parts = [part.strip() for part in _split(values, where)]
        if len(parts) == 1:
            fixed.append(text)
            continue
        if "" in parts:
            raise MavherdError(f"{where}: a value is empty (write '' for no text, null for none)")
        if twice := _repeated(parts):
            raise MavherdError(f"{where}: {twice} is there twice")
        grid.append(Axis(key, tuple(parts)))
    return tuple(fixed), tuple(grid)


def _split(text: str, where: str) -> Iterator[str]:
    """Yield the parts between commas that nothing encloses, by YAML's rules."""
    begin, depth, quote, at, before = 0, 0, "", 0, ","  # `before`: the last letter but for spaces
    while at < len(text):
        char = text[at]
        if quote:
            if quote == '"' and char == "\\":
                at += 1
            elif char == quote:
                if quote == "'" and text[at : at + 2] == "''":
                    at += 1
                else:
                    quote = ""
        elif char in "'\"" and before in ",:" + OPEN:
            quote = char
        elif char in OPEN and (depth or before == ","):
            depth += 1
        elif char in CLOSE and depth:
            depth -= 1
        elif char == "," and not depth:
            yield text[begin:at]
            begin = at + 1
        before = before if char.isspace() else char
        at += 1
    if quote or depth:
        what = f"a {quote}" if quote else "a bracket"
        raise MavherdError(f"{where}: {what} is not closed")
    yield text[begin:]


def read_seeds(text: str) -> tuple[int, ...]:
    """Return the seeds of `0:200` (200 is not one of them), `0,5,9` or both mixed."""
    ranges = [_seed_range(part.strip(), f"--seeds {text}") for part in text.split(",")]
    count = sum(r.stop - r.start for r in ranges)  # len() stops at the size of a C integer
    if count > MAX_RUNS:
        raise MavherdError(f"--seeds {text}: {count} seeds (at most {MAX_RUNS:,} runs)")
    seeds = [seed for each in ranges for seed in each]
    if twice := _repeated(seeds):
        raise MavherdError(f"--seeds {text}: {twice} is there twice")
    return tuple(seeds)


def _seed_range(part: str, where: str) -> range:
    first, colon, end = part.partition(":")
    if not all(x.isascii() and x.isdigit() and len(x) < 20 for x in (first, end or "0")):
        raise MavherdError(f"{where}: {part!r} is no seed (as in 0:200, or 0,5,9)")
    if colon and not end:
        raise MavherdError(f"{where}: {part!r} has no end (as in 0:200)")
    seeds = range(int(first), int(end) if colon else int(first) + 1)
    if not seeds:
        raise MavherdError(f"{where}: {part} holds no seed (the end is not one of them)")
    if seeds[-1] > MAX_SEED:
        raise MavherdError(f"{where}: a seed is at most {MAX_SEED}")
    return seeds


def seeds_text(seeds: Sequence[int]) -> str:
    """Return the shortest text that `read_seeds` reads as these."""
    parts: list[str] = []
    begin = 0
    for k in range(1, len(seeds) + 1):
        if k == len(seeds) or seeds[k] != seeds[k - 1] + 1:
            few = k - begin < 3
            run = seeds[begin:k]
            parts += [str(s) for s in run] if few else [f"{run[0]}:{run[-1] + 1}"]
            begin = k
    return ",".join(parts)


def _repeated(items: Sequence[object]) -> str:
    """Return the first item that is there twice, as text, or nothing."""
    seen: set[object] = set()
    for item in items:
        if item in seen:
            return str(item)
        seen.add(item)
    return ""
