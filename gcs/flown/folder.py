"""The folder that a run has left: which files are whole, and what is said of one that is none."""

import json
from contextlib import suppress
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from ... import __version__
from ...transport.errors import MavherdError

REPORT_SCHEMA = 2
"""The newest schema of report.json that this program knows; older ones are read too."""

_SIGNS = "scenario.yaml", "vehicles"
_SWEEP = "sweep.json"


class RunFolderError(MavherdError):
    """A folder that no run has left, or that cannot be read: the text says which and the cure."""


def check_folder(folder: Path) -> None:
    """Raise RunFolderError, with what to give instead, when `folder` is not that of one run."""
    try:
        problem = _problem(folder)
    except OSError as error:
        raise unreadable(error, folder) from None
    if problem:
        raise RunFolderError(f"{folder}: {problem}")


def is_run(folder: Path) -> bool:
    """Return whether a run has begun to write this folder."""
    return all((folder / name).exists() for name in _SIGNS)


def read_report(folder: Path) -> dict[str, Any] | None:
    """Return report.json; None when the run has not come to write it, {} when it is damaged.

    Raises RunFolderError for one that a newer mavherd has made, or that may not be read.
    """
    path = folder / "report.json"
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise unreadable(error, folder) from None
    except ValueError:
        return {}
    if not isinstance(report, dict):
        return {}
    schema = report.get("schema", 1)
    if not isinstance(schema, int) or schema > REPORT_SCHEMA:
        raise RunFolderError(
            f"{path}: made by a newer mavherd, {made_by(report)}: its schema is {schema}, this is"
            f" {__version__} and reads up to {REPORT_SCHEMA} (install the newer one)"
        )
    return report


def made_by(report: dict[str, Any] | None) -> str:
    """Return the version of mavherd that made a run, as far as its report says it."""
    return str((report or {}).get("version") or "of unknown version")


def whole_or_part(path: Path) -> Path | None:
    """Return the file, or the `.part` that it was going to be; None when there is neither."""
    part = path.with_name(path.name + ".part")
    return path if path.exists() else part if part.exists() else None


def unreadable(error: OSError, folder: Path) -> RunFolderError:
    """Return what is said of a file of a run that cannot be read."""
    return RunFolderError(
        f"{error.filename}: {error.strerror} (is {folder} the folder of a run, with"
        " scenario.yaml and each vehicle's tlog?)"
    )


def _problem(folder: Path) -> str:
    """Return why this is not the folder of a run, and the cure; "" when it is."""
    if not folder.exists():
        return f"there is no such folder{_nearest(folder)}"
    if not folder.is_dir():
        hint = f"give its folder, {folder.parent}" if is_run(folder.parent) else "give its folder"
        return f"this is a file, not the folder of a run ({hint})"
    if is_run(folder):
        return ""
    if (folder / _SWEEP).exists():
        return "this is the folder of a sweep, not of one run (its table is results.parquet)"
    runs = sorted(filter(is_run, folder.iterdir()), key=lambda run: run.stat().st_mtime)
    if runs:
        return (
            f"this is not the folder of a run, but holds {len(runs)} (give one of them;"
            f" the newest is {runs[-1]})"
        )
    lacks = " and ".join(name for name in _SIGNS if not (folder / name).exists())
    return f"this is not the folder of a run (it has no {lacks})"


def _nearest(folder: Path) -> str:
    """Return a hint: the run beside it that is called most alike."""
    with suppress(OSError):
        names = [path.name for path in folder.parent.iterdir() if is_run(path)]
        if near := get_close_matches(folder.name, names, n=1):
            return f" (did you mean {folder.parent / near[0]}?)"
    return ""
