"""A run judged again, and its report written again, from what is in its folder.

What only the run itself knew (wall time, processor time, how it was paced, what it ended with) is
kept from the report that it left. A run that was killed left none: of it those things are unknown,
it has failed, and its report says what is missing.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ...transport.errors import VehicleError
from ...transport.tlog import digest, torn_at
from ..diff.run_folder import open_run
from ..report.judge import Verdict
from ..report.outcome import FAILED, PASSED, Ending, Outcome, assess, traffic_of
from ..report.report import write_report
from ..run.readiness import Readiness
from .flown import Flown

if TYPE_CHECKING:
    from ..report.truth import Track

KILLED = "the run was killed: it left no report"
DAMAGED = "how the run ended is not known: its report.json was damaged"
_NO_REPORT = "report.json: {} was left; this one is made of the logs"
_KEPT = (
    *("run_id", "started_at", "speed", "in_process", "wall_s", "real_time_factor", "cpu"),
    *("ticks", "late_ticks", "outside_clients", "version", "compiled", "python", "platform"),
    "ports",
)
_UNKNOWN = (
    *("started_at", "speed", "wall_s", "real_time_factor"),
    *("late_ticks", "outside_clients", "script"),
)

Step = Callable[[str], None]
"""Is told what is being done."""


@dataclass(frozen=True)
class Judged:
    """A run that was judged again."""

    report: dict[str, Any]
    verdict: Verdict
    tracks: "list[Track]"


def report_again(flown: Flown, step: Step) -> Outcome:
    """Write report, tables and figures into a run's folder again; raise OSError when it cannot be.

    Of a run that has ended by itself report.json comes out as it was.
    """
    judged = judge_again(flown, step)
    report, verdict, tracks = judged.report, judged.verdict, judged.tracks
    folder, scenario, starts = flown.folder, flown.scenario, flown.starts
    notes = write_report(folder, report, scenario, starts, tracks, verdict, step=step)
    told = (flown.report or {}).get("digest")
    if told and told != report["digest"]:
        found = str(report["digest"] or "none")
        notes.append(f"its logs give digest {found[:16]}, not {told[:16]} (they were changed)")
    return Outcome(report["exit_code"], flown.folder, report, notes)


def judge_again(flown: Flown, step: Step = lambda _: None) -> Judged:
    """Judge a run by its logs. Raises MavherdError for one that cannot be read."""
    step("reading the logs")
    tracks = flown.tracks()
    lockstep = open_run(flown.folder).lockstep
    ending = _ending(flown, tracks, lockstep)
    traffic = traffic_of(flown.folder, flown.starts)
    step("judging")
    report, verdict = assess(
        flown.scenario,
        flown.starts,
        tracks,
        ending,
        run_id=flown.folder.resolve().name,
        digest=_digest(flown) if lockstep and ending.ticks else None,
        lockstep=lockstep,
        in_process=not (flown.folder / "ports.json").exists(),
        traffic=traffic,
    )
    if flown.report is None:
        return Judged(report | dict.fromkeys(_UNKNOWN), verdict, tracks)
    kept = {key: flown.report[key] for key in _KEPT if key in flown.report}
    cpu = {r["name"]: r.get("cpu_s") for r in flown.report.get("robots", ())}
    robots = [robot | {"cpu_s": cpu.get(robot["name"])} for robot in report["robots"]]
    return Judged(report | kept | {"robots": robots}, verdict, tracks)


def _ending(flown: Flown, tracks: "list[Track]", lockstep: bool) -> Ending:
    """Return how the run ended, by its report or, without one, by its logs."""
    told = flown.report
    if told is None:
        ready = Readiness(len(flown.starts))
        for event in flown.events():
            ready.note(event)
        now = max((float(track.time[-1]) for track in tracks), default=0.0)
        return Ending(
            exit_code=VehicleError.exit_code,
            error=DAMAGED if flown.damaged else KILLED,
            now=now,
            ready_at=ready.at,
            ticks=int(now * 1e6) // flown.scenario.team.period_us if lockstep else 0,
            missing=(
                _NO_REPORT.format("a damaged one" if flown.damaged else "none"),
                *flown.missing[1:],
            ),
        )
    code = told.get("exit_code", PASSED)
    return Ending(
        exit_code=PASSED if code == FAILED else code,  # the judge says it again
        error=told.get("error"),
        now=told["duration_s"],
        wall_s=told.get("wall_s") or 0.0,
        ready_at=told.get("ready_at_s"),
        ticks=told.get("ticks") or 0,
        late_ticks=told.get("late_ticks") or 0,
        outside_clients=told.get("outside_clients") or 0,
        script=told.get("script"),
        missing=flown.missing,
    )


def _digest(flown: Flown) -> str | None:
    """Return the digest of the logs; None when one of them is not whole."""
    logs = [flown.tlog(s.name) for s in sorted(flown.starts, key=lambda s: s.system_id)]
    whole = [log for log in logs if log and log.suffix != ".part" and torn_at(log) is None]
    return digest(whole) if len(whole) == len(logs) else None
