"""Rerun's viewers: processes of their own, a window or a page in a browser, that nobody waits for.

The real binary is started, for the `rerun` script is a wrapper: who kills that leaves the viewer
behind. Everything listens on loopback only.
"""

import os
import re
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType

from ...transport.errors import MavherdError
from ..complaint import INSTALL
from ..run.children import how_it_ended

OTHER_BINARY = "MAVHERD_RERUN"
"""Names, in the environment, another viewer than the one that comes with the extra `view`."""

LOOPBACK = "127.0.0.1"
_DISPLAYS = "DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"
_END_S = 2.0  # for a viewer to end before it is killed
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_LONGEST = 200  # characters of a viewer's last words
# Ends the viewer when standard input does, which is when we are gone, however that came about.
_LEASH = """
exec 3<&0
"$@" </dev/null 3<&- & viewer=$!
(read -r _ <&3; kill $viewer 2>/dev/null) & leash=$!
exec 3<&-
wait $viewer; code=$?
kill $leash 2>/dev/null
exit $code
"""


class ViewerError(MavherdError):
    """A viewer that cannot be started: the text says why, and what to do instead."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Viewing:
    """Which viewers a user wants, and where; None takes the standard port or the next free."""

    native: bool = False
    web: bool = False
    view_port: int | None = None  # where viewers get the data
    web_port: int | None = None  # where a browser gets the page

    def __bool__(self) -> bool:
        return self.native or self.web


def check_viewers(viewing: Viewing) -> None:
    """Raise ViewerError where the viewers that are wanted cannot be had."""
    rerun_binary()
    if viewing.native:
        check_display(os.environ)


def rerun_binary() -> Path:
    """Return the viewer; raise ViewerError where there is none, with how to get it."""
    if other := os.environ.get(OTHER_BINARY):
        if not os.access(other, os.X_OK):
            raise ViewerError(f"{OTHER_BINARY}={other}: there is no such program (unset it)")
        return Path(other)
    spec = find_spec("rerun_cli")
    binary = Path(spec.origin).with_name("rerun") if spec and spec.origin else None
    if binary is None or not binary.exists():
        raise ViewerError(f"rerun is not installed, so there is no viewer: {INSTALL}")
    return binary


def check_display(environment: Mapping[str, str]) -> None:
    """Raise ViewerError where no window can be opened."""
    if not sys.platform.startswith("linux") or any(map(environment.get, _DISPLAYS)):
        return
    raise ViewerError(
        "there is no display for a viewer's window: $DISPLAY and $WAYLAND_DISPLAY are not set"
        " (--web shows it in a browser; what is recorded, `mavherd view RUN` shows later)"
    )


class Viewer:
    """One viewer's process, in a session of its own; what it prints goes to the end of `log`.

    On a `leash` it ends when we do; without one it stays, and is the user's to close.
    """

    def __init__(
        self,
        name: str,
        options: Sequence[object],
        log: Path,
        *,
        leash: bool,
        environment: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        binary = rerun_binary()
        command = [str(binary), "--bind", LOOPBACK, *map(str, options)]
        if leash:
            command = ["/bin/sh", "-c", _LEASH, "sh", *command]
        self.name = name
        self._log = log
        self._told = self._ours = False
        with log.open("ab") as output:
            self._begin = output.tell()
            try:
                self.process = subprocess.Popen(  # noqa: S603
                    command,
                    stdin=subprocess.PIPE if leash else subprocess.DEVNULL,
                    stdout=output,
                    stderr=output,
                    env={**os.environ, **environment},
                    start_new_session=True,
                )
            except OSError as error:
                raise ViewerError(f"{binary}: cannot be started: {error.strerror}") from None

    @property
    def ended(self) -> bool:
        """Whether it is gone."""
        return self.process.poll() is not None

    def death(self) -> str:
        """Return, once, why it has ended, unless somebody has closed it as one does."""
        code = self.process.poll()
        if not code or self._told or self._ours:
            return ""
        self._told = True
        if code > 128:  # the shell's word for a signal
            code = 128 - code
        words = self.last_words() if code > 0 else ""
        return f"the {self.name} {how_it_ended(code)}" + (f": {words}" if words else "")

    def last_words(self) -> str:
        """Return the line that tells best why it has ended."""
        with suppress(OSError), self._log.open("rb") as log:
            log.seek(self._begin)
            text = _COLOURS.sub("", log.read().decode("utf-8", "replace"))
            lines = [line.strip() for line in text.splitlines() if line.strip()]
            errors = [line for line in lines if line.startswith("Error")]
            line = (errors or lines or [""])[-1].removeprefix("Error: ")
            return line if len(line) <= _LONGEST else line[:_LONGEST] + "..."
        return ""

    def wait(self) -> None:
        """Wait until it is closed."""
        self.process.wait()

    def end(self) -> None:
        """End it, if it is on a leash; a viewer that is frozen is killed."""
        if (stdin := self.process.stdin) is None:
            self.process.returncode = self.process.poll() or 0  # it is the user's now
            return
        self._ours = True
        with suppress(OSError):
            stdin.close()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(_END_S)
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, 9)
        self.process.wait()


def open_window(source: str | Iterable[Path], log: Path, *, leash: bool) -> Viewer:
    """Start the native viewer on what is served at `source`, or on files."""
    served = [f"--connect={source}"] if isinstance(source, str) else ["--port", "auto", *source]
    return Viewer("viewer", ["--hide-welcome-screen", *served], log, leash=leash)


def open_page(source: str | Iterable[Path], data_port: int, page_port: int, log: Path) -> Viewer:
    """Start the web server, which hands out the page and, of files, the data."""
    served = [source] if isinstance(source, str) else ["--port", data_port, *source]
    options = ["--web-viewer-port", page_port, "--serve-web", *served]
    return Viewer("web server", options, log, leash=True)
