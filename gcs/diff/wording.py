"""The difference of two runs in lines for people."""

from collections.abc import Iterator
from typing import Any

from .links import LinkDifference, Parting
from .messages import FieldDifference, differences, is_damaged, name_of, show
from .run_folder import Entry, FlownRun
from .runs import RunDifference

MAX_SETTINGS = 8  # lines
MAX_LATER = 12  # lines; --json has all
_MAX_FIELDS = 6
_ABOUT = "version", "python", "platform", "compiled"  # in report.json; an old one may lack some


def direction(parting: Parting) -> str:
    """Return which way the message went."""
    return "ground to vehicle" if parting.to_vehicle else "vehicle to ground"


def notes(d: RunDifference) -> Iterator[str]:
    """Yield what is to be known of the two runs before their links are compared."""
    yield from _damage(d)
    yield from _conditions(d)


def damaged(parting: Parting) -> list[str]:
    """Return in which of the runs, A or B, the parting message is not as it was sent."""
    sides = ("A", parting.a), ("B", parting.b)
    return [run for run, entry in sides if entry and is_damaged(entry.frame)]


def _damage(d: RunDifference) -> Iterator[str]:
    for name, texts in (("A", d.damage_a), ("B", d.damage_b)):
        yield from (f"{name}: {text}" for text in texts)


def _conditions(d: RunDifference) -> Iterator[str]:
    for name, run in (("A", d.a), ("B", d.b)):
        yield from (f"{name}: {text}" for text in _notes(run))
    for key in _ABOUT:
        a, b = d.a.report.get(key), d.b.report.get(key)
        if d.a.report and d.b.report and a != b:
            yield f"{key}: {_absent(a)} | {_absent(b)}"
    for name, vehicles in (("A", d.only_in_a), ("B", d.only_in_b)):
        if vehicles:
            yield f"only in {name}: {', '.join(vehicles)}"
    if d.links and not any(sum(link.messages) for link in d.links):
        yield "no messages in either run (they ended before the first tick): nothing is compared"


def lines(d: RunDifference) -> Iterator[str]:
    """Yield what differs from the start, then the first parting, what went before, what follows."""
    yield from _preface(d)
    total = sum(link.equal for link in d.links)
    if d.equal:
        vehicles = f"{len(d.links)} vehicle{'s' * (len(d.links) > 1)}"
        digest = d.a.report.get("digest")
        yield f"equal: {vehicles}, {total} messages" + (f", digest {digest[:16]}" if digest else "")
        return
    if not d.links:
        yield "no vehicle in common: nothing is compared"
        return
    if not d.partings:
        alike = "both have the same vehicles" if d.only_in_a or d.only_in_b else "the logs go"
        yield f"equal as far as {alike}: {total} messages"
        return
    first, *later = d.partings
    yield from _first(first)
    if later:
        yield "then part:"
        yield from (f"  {headline(link)}" for link in later[:MAX_LATER])
    if len(later) > MAX_LATER:
        yield f"  and {len(later) - MAX_LATER} more (--json has all)"
    same = [link.vehicle for link in d.links if not link.parting]
    if same:
        yield f"equal to the end: {', '.join(same)}"


def headline(link: LinkDifference) -> str:
    """Return one line: vehicle, time, message and field, both values."""
    if (parting := link.parting) is None:
        return f"{link.vehicle}: equal"
    way, name = direction(parting), name_of(parting.entry.frame)
    a, b = parting.a, parting.b
    where = f"{link.vehicle} at {_seconds(parting.entry)} s"
    if a and b and a.time_us != b.time_us and parting.kind != "time":
        where = f"{link.vehicle} at {_seconds(a)} s | {_seconds(b)} s"  # each by its own clock
    if bad := damaged(parting):
        runs = " and ".join(bad)
        return f"{where}: {name} ({way}): a frame that is damaged in {runs} (its checksum is wrong)"
    if a is None or b is None:
        run = "A" if a else "B"
        if parting.kind == "end":
            rest = abs(link.messages[0] - link.messages[1])
            other = "B" if a else "A"
            return (
                f"{where}: {other} has ended; {rest} more messages in {run}, first {name} ({way})"
            )
        return f"{where}: {name} ({way}) only in {run}"
    if parting.kind == "value":
        field = differences(a.frame, b.frame)[0]
        return f"{where}: {name}{_dotted(field)} ({way}): {_both(field)}"
    if parting.kind == "time":
        return f"{where}: {name} ({way}) at {_seconds(a)} s | at {_seconds(b)} s"
    text = f"{where}: {name_of(a.frame)} | {name_of(b.frame)}"
    return f"{text} ({way}){', in the other order' if parting.kind == 'order' else ''}"


def _preface(d: RunDifference) -> Iterator[str]:
    yield f"A {d.a.folder}"
    yield f"B {d.b.folder}"
    yield from _damage(d)
    if d.settings:
        yield "different scenarios:"
    for key, a, b in d.settings[:MAX_SETTINGS]:
        yield f"  {key}: {_absent(a)} | {_absent(b)}"
    if len(d.settings) > MAX_SETTINGS:
        yield f"  and {len(d.settings) - MAX_SETTINGS} more keys (--json has all)"
    yield from _conditions(d)


def _notes(run: FlownRun) -> Iterator[str]:
    report = run.report
    if not report:
        yield (
            "report.json: this is not a run's report (`mavherd report` writes it again)"
            if run.damaged
            else "no report.json (it was killed, or goes on)"
        )
    if not run.lockstep:
        yield (
            "ran free: such runs follow the wall clock and are never equal byte for byte;"
            " compare reports or states instead"
        )
    if clients := report.get("outside_clients"):
        yield f"{clients} outside client{'s' * (clients > 1)} took part, and may have steered"
    if error := report.get("error"):
        yield f"ended with: {error}"
    torn = [vehicle for vehicle in run.vehicles if run.is_torn(vehicle)]
    if torn:
        text = ", ".join(torn[:MAX_LATER]) + (", ..." if len(torn) > MAX_LATER else "")
        yield f"logs without their end (.part): {text}"


def _first(link: LinkDifference) -> Iterator[str]:
    yield headline(link)
    parting = link.parting
    if parting and parting.kind == "value" and parting.a and parting.b and not damaged(parting):
        rest = differences(parting.a.frame, parting.b.frame)[1:]
        for field in rest[:_MAX_FIELDS]:
            yield f"  also {field.name}: {_both(field)}"
        if len(rest) > _MAX_FIELDS:
            yield f"  and {len(rest) - _MAX_FIELDS} more fields"
    many = f"{link.equal} message{'s' * (link.equal != 1)}"
    yield f"  before: {many} of {link.vehicle} equal" + (", the last:" if link.before else "")
    for entry in link.before:
        way = direction(Parting("value", entry, None))
        yield f"    {_seconds(entry)} s  {name_of(entry.frame)} ({way})"


def _dotted(field: FieldDifference) -> str:
    return f", {field.name}" if " " in field.name else f".{field.name}"


def _both(field: FieldDifference) -> str:
    return f"{show(field.a, field.kind)} | {show(field.b, field.kind)}"


def _seconds(entry: Entry) -> str:
    return f"{entry.time_us * 1e-6:.2f}"


def _absent(value: Any) -> str:
    return "-" if value is None else str(value)
