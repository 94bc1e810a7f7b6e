"""A comparison as files: `compare.json`, `compare.html` with its figures, `compare.rrd`."""

import json
import secrets
import time
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from ..complaint import INSTALL
from ..flown.folder import RunFolderError, is_run
from ..new_file import write_text
from ..report.plain import plain
from .lineup import LineUp
from .measures import Standing, standings
from .page import page

SCHEMA = 1
DATA, PAGE, RECORDING = "compare.json", "compare.html", "compare.rrd"


class Written(NamedTuple):
    """What a comparison came to, and where it is."""

    standings: list[Standing]
    data: dict[str, Any]  # what compare.json holds
    files: list[Path]  # for people, the page first
    notes: list[str]  # what is missing, and what to install


def new_folder(scenarios: Sequence[str]) -> Path:
    """Return the name of a folder that nobody has."""
    what = scenarios[0] if len(scenarios) == 1 else "mixed"
    return Path("comparisons") / f"{what}-{time.strftime('%Y%m%d-%H%M%S')}-{secrets.token_hex(2)}"


def check_place(folder: Path, *, force: bool) -> None:
    """Raise RunFolderError when a comparison in `folder` would spoil what is there.

    `force` lets it replace another comparison.
    """
    if not folder.is_dir() or not any(folder.iterdir()):
        return
    if is_run(folder):
        raise RunFolderError(f"{folder}: this is the folder of a run (give another -o)")
    if not (folder / DATA).exists():
        raise RunFolderError(f"{folder}: has files that are no comparison's (give another -o)")
    if not force:
        raise RunFolderError(f"{folder}: has a comparison already (--force replaces it)")


def compare(found: LineUp, folder: Path, step: Callable[[str], None]) -> Written:
    """Write the comparison into `folder`; raise OSError when that cannot be."""
    folder.mkdir(parents=True, exist_ok=True)
    alike = len(found.scenarios) == 1
    measured = standings([run.report for run in found.runs], alike=alike)
    data = as_json(found, measured)
    write_text(folder / DATA, json.dumps(data, indent=2, allow_nan=False) + "\n")
    missing: list[str] = []
    pictures: list[Path] = []
    if find_spec("matplotlib") is None:
        missing.append("matplotlib is missing, so no figures")
    else:
        from .figures import draw

        step("drawing")
        pictures = draw(folder / "figures", found)
    recording = folder / RECORDING if find_spec("rerun") else None
    write_text(folder / PAGE, page(found, measured, pictures, recording))
    files = [folder / PAGE]
    if recording is None:
        missing.append("rerun-sdk is missing, so no compare.rrd")
    else:
        from ..recording.comparison import record_comparison

        step("recording")
        files.append(record_comparison(recording, found, measured))
    notes = [f"{'; '.join(missing)} ({INSTALL})"] if missing else []
    return Written(measured, data, files, notes)


def as_json(found: LineUp, measured: Sequence[Standing]) -> dict[str, Any]:
    """Return the comparison as plain data that is valid JSON."""
    labels = [run.label for run in found.runs]
    data = {
        "schema": SCHEMA,
        "runs": [
            {
                "label": run.label,
                "folder": str(run.flown.folder.resolve()),
                **{key: run.report.get(key) for key in _FACTS},
                "partial": run.flown.partial,
                "missing": run.flown.missing,
            }
            for run in found.runs
        ],
        "settings": {key: dict(zip(labels, v, strict=True)) for key, v in found.settings.items()},
        "measures": [
            {
                "key": s.measure.key,
                "name": s.measure.head,
                "unit": s.measure.unit,
                "better": s.measure.better or None,
                "values": dict(zip(labels, s.values, strict=True)),
                "best": [labels[k] for k in sorted(s.best)],
                "worst": [labels[k] for k in sorted(s.worst)],
            }
            for s in measured
        ],
    }
    return dict(plain(data))


_FACTS = "run_id", "scenario", "law", "seed", "passed", "exit_code", "error", "digest"
