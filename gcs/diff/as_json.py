"""The difference of two runs for programs."""

from math import isfinite
from typing import Any

from .links import LinkDifference, Parting
from .messages import differences, name_of
from .run_folder import Entry, FlownRun
from .runs import RunDifference
from .wording import damaged, direction, notes

_FACTS = (
    *("run_id", "scenario", "seed", "law", "lockstep", "digest", "exit_code", "duration_s"),
    *("outside_clients", "partial", "version", "python", "platform", "compiled"),
)


def as_json(d: RunDifference) -> dict[str, Any]:
    """Return it as plain data that is valid JSON."""
    partings = d.partings
    return {
        "equal": d.equal,
        "a": _run(d.a),
        "b": _run(d.b),
        "notes": list(notes(d)),
        "settings": [setting._asdict() for setting in d.settings],
        "only_in_a": list(d.only_in_a),
        "only_in_b": list(d.only_in_b),
        "first": _link(partings[0]) if partings else None,
        "vehicles": [_link(link) for link in d.links],
    }


def _run(run: FlownRun) -> dict[str, Any]:
    facts = {key: run.report[key] for key in _FACTS if key in run.report}
    return {"folder": str(run.folder), **facts, "lockstep": run.lockstep}


def _link(link: LinkDifference) -> dict[str, Any]:
    a, b = link.messages
    return {
        "vehicle": link.vehicle,
        "system_id": link.system_id,
        "messages": {"a": a, "b": b},
        "equal": link.equal,
        "parting": _parting(link.parting) if link.parting else None,
        "before": [_message(entry) for entry in link.before],
    }


def _parting(parting: Parting) -> dict[str, Any]:
    a, b = parting.a, parting.b
    bad = damaged(parting)
    valued = parting.kind == "value" and not bad
    fields = differences(a.frame, b.frame) if valued and a and b else []
    return {
        "kind": parting.kind,
        "time_s": parting.entry.time_us * 1e-6,
        "message": name_of(parting.entry.frame),
        "direction": direction(parting),
        "damaged_in": bad,
        "fields": [{"name": f.name, "a": _plain(f.a), "b": _plain(f.b)} for f in fields],
        "a": _message(a) if a else None,
        "b": _message(b) if b else None,
    }


def _message(entry: Entry) -> dict[str, Any]:
    return {
        "time_s": entry.time_us * 1e-6,
        "message": name_of(entry.frame),
        "direction": direction(Parting("value", entry, None)),
        "frame": entry.frame.hex(),
    }


def _plain(value: Any) -> Any:
    """Return a field's value; what JSON cannot say as text."""
    if isinstance(value, float) and not isfinite(value):
        return str(value)
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value
