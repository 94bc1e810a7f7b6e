"""Whether a run's logs are still what the run has written."""

from collections.abc import Iterator

from ...transport.tlog import digest, tear, torn_at
from ..flown.folder import unreadable
from .run_folder import FlownRun


def damage(run: FlownRun) -> Iterator[str]:
    """Yield what is wrong with its logs; a `.part` is unfinished, which is another thing.

    Raises MavherdError for a log that cannot be read.
    """
    told = run.report.get("digest")
    logs = [run.log(name) for name in run.vehicles if not run.is_torn(name)]
    found = ""
    try:
        tears = [(log, at) for log in logs if (at := torn_at(log)) is not None]
        if told and not tears and len(logs) == len(run.vehicles):
            found = digest(logs)
    except OSError as error:
        raise unreadable(error, run.folder) from None
    for log, at in tears:
        if at or run.report.get("ticks") != 0:  # before its first tick a run leaves empty logs
            yield f"{log.name} is {tear(at)}"
    if found and isinstance(told, str) and told != found:
        yield (
            f"its logs give digest {found[:16]}, not {told[:16]} as in report.json"
            " (they were changed after the run)"
        )
