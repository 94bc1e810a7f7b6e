"""Recordings that were made before: found, checked, and laid out as a viewer takes them."""

import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from ...transport.errors import MavherdError
from ..complaint import INSTALL
from ..flown.flown import open_flown
from ..flown.folder import is_run
from .contents import has_begun
from .viewers import rerun_binary

_MAGIC = b"RRF"  # of every version
_COMPARISON = "compare.rrd"


class ReplayError(MavherdError):
    """A recording that cannot be shown: the text says which, why and the cure."""


class Recording(NamedTuple):
    """One recording; `run` is the folder of the run that has left it, None where there is none."""

    path: Path
    run: Path | None
    note: str = ""  # what a user must know of it

    @property
    def name(self) -> str:
        """Return a name for the file: whose it is."""
        return (self.run or self.path).absolute().name.removesuffix(".part").removesuffix(".rrd")


def find_recording(path: Path) -> Recording:
    """Return the recording of a run's folder, or the one that `path` is itself.

    Raises MavherdError when there is none.
    """
    if path.is_dir() and (path / _COMPARISON).exists():
        return _checked(Recording(path / _COMPARISON, None))
    if path.is_dir() or not _is_file_name(path):
        return _of_run(path)
    if not path.exists():
        raise ReplayError(f"{path}: there is no such file")
    return _checked(Recording(path, path.parent if is_run(path.parent) else None, _end_of(path)))


def lay_out(recordings: Sequence[Recording], folder: Path) -> list[Path]:
    """Return the files for a viewer, in `folder`; it takes none that breaks off.

    Raises ReplayError when nothing was recorded.
    """
    names = [recording.name for recording in recordings]
    files = []
    for at, recording in enumerate(recordings):
        again = names[:at].count(names[at])
        file = folder / f"{names[at]}{f'-{again + 1}' if again else ''}.rrd"
        if recording.path.suffix == ".part":
            mend(recording, file)
        else:
            file.symlink_to(recording.path.absolute())
        if (recording.run or recording.path.suffix == ".part") and not has_begun(file):
            raise ReplayError(f"{recording.path}: nothing was recorded yet{_cure(recording.run)}")
        files.append(file)
    return files


def mend(recording: Recording, file: Path) -> None:
    """Write what can be read of a recording that breaks off."""
    merge = "rrd", "merge", "--continue-on-error", str(recording.path), "-o", str(file)
    done = subprocess.run([rerun_binary(), *merge], capture_output=True, check=False)  # noqa: S603
    if done.returncode or not file.exists():
        raise ReplayError(f"{recording.path}: nothing of it can be read{_cure(recording.run)}")


def select(recordings: Sequence[Recording], robot: str, folder: Path) -> Path:
    """Return a layout that shows the plots of `robot`, as a file in `folder`."""
    from .layout import layout
    from .stage import read_stage
    from .stream import APPLICATION

    stages = [read_stage(r.run) for r in recordings if r.run]
    if not stages:
        raise ReplayError(
            f"--select {robot}: {recordings[0].path} is in no run's folder (give one)"
        )
    for stage in stages:
        if robot in stage.kinds:
            file = folder / "layout.rbl"
            try:
                layout(stage, selected=(robot,)).save(APPLICATION, file)
            except ModuleNotFoundError:
                raise ReplayError(f"rerun is not installed: {INSTALL}") from None
            return file
    names = ", ".join(stages[0].kinds)
    raise ReplayError(f"--select {robot}: the run has no such robot (it has {names})")


def _of_run(folder: Path) -> Recording:
    flown = open_flown(folder)
    if (path := flown.recording) is None:
        if flown.goes_on():
            raise ReplayError(f"{folder}: the run goes on, and nothing is recorded yet")
        raise ReplayError(f"{folder}: the run left no recording{_cure(folder)}")
    if flown.goes_on():
        note = f"{folder}: the run goes on; this is what is recorded so far"
    else:
        told = flown.damaged and f"{folder}: {flown.damaged}"
        note = "; ".join(filter(None, (_end_of(path), told)))
    return _checked(Recording(path, folder, note))


def _cure(run: Path | None) -> str:
    if run is None:
        return ""
    force = " --force" if (run / "run.rrd").exists() else ""
    return f" (`mavherd convert {run}{force}` makes one of its logs)"


def _end_of(path: Path) -> str:
    return f"{path}: this recording is partial, it breaks off" if path.suffix == ".part" else ""


def _is_file_name(path: Path) -> bool:
    return path.is_file() or path.name.endswith((".rrd", ".rrd.part"))


def _checked(recording: Recording) -> Recording:
    path, run = recording.path, recording.run
    try:
        with path.open("rb") as file:
            magic = file.read(len(_MAGIC))
    except OSError as error:
        raise ReplayError(f"{path}: cannot be read: {error.strerror}") from None
    if magic == _MAGIC:
        return recording
    if not magic and run:
        raise ReplayError(f"{path}: nothing was recorded{_cure(run)}")
    hint = f"`mavherd convert {path}` makes one of a tlog" if path.suffix == ".tlog" else "an .rrd"
    raise ReplayError(f"{path}: this is no Rerun recording ({hint})")
