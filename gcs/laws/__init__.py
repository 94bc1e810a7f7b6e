"""Coordination laws, selected by name; adding one is one file and one line here."""

from collections.abc import Callable, Collection, Mapping
from difflib import get_close_matches
from inspect import signature
from math import isfinite

from ...transport.errors import MavherdError
from .base import HOLD, Command, Law, Nominal, Peer, reach_of
from .off import Off
from .paper import Paper
from .safe import Safe

__all__ = ["HOLD", "LAWS", "Command", "Law", "LawError", "Nominal", "Peer", "make_law", "reach_of"]

# name -> factory(*, kind, v_max, state_timeout, and the law's own parameters with their defaults)
LAWS: dict[str, Callable[..., Law]] = {"off": Off, "paper": Paper, "safe": Safe}

_COMMON = {"kind", "v_max", "state_timeout"}


class LawError(MavherdError):
    """A coordination law or a parameter of one that does not exist or cannot be used."""


def make_law(
    name: str,
    *,
    kind: str,
    v_max: float,
    state_timeout: float = 1.0,
    params: Mapping[str, float] | None = None,
) -> Law:
    """Return law `name` for one robot of `kind` that moves at up to `v_max` m/s.

    A neighbour's state older than `state_timeout` seconds counts as unknown.
    """
    if kind not in ("quadcopter", "rover"):
        raise ValueError(f"unknown kind {kind!r}")
    if name not in LAWS:
        raise LawError(_unknown("law", name, LAWS))
    factory = LAWS[name]
    known = [p for p in signature(factory).parameters if p not in _COMMON]
    params = params or {}
    for key, value in params.items():
        if key not in known:
            raise LawError(f"law {name!r}: " + _unknown("parameter", key, known))
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
            raise LawError(f"law {name!r}: {key} must be a finite number, got {value!r}")
    for key, value in (("v_max", v_max), ("state_timeout", state_timeout)):
        if not (isfinite(value) and value > 0):
            raise LawError(f"{key} must be positive and finite, got {value}")
    try:
        return factory(kind=kind, v_max=v_max, state_timeout=state_timeout, **params)
    except ValueError as error:
        raise LawError(f"law {name!r}: {error}") from error


def _unknown(what: str, name: str, known: Collection[str]) -> str:
    close = get_close_matches(name, known, n=1)
    hint = f"did you mean {close[0]!r}? " if close else ""
    there = f"known: {', '.join(known)}" if known else "it has none"
    return f"unknown {what} {name!r} ({hint}{there})"
