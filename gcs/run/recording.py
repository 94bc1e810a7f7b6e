"""The launcher's end of the recorder process. Nothing depends on it but the recording."""

import os
import select
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from .children import Child, how_it_ended

_SLICE_S = 0.1  # how often a wait looks whether the user has pressed Ctrl-C
_SHOW = "lost viewers: "
_GONE_S = 1.0  # for it to end when nobody watches any more


class Recorder:
    """Starts the recorder of the run in `folder`, and ends it.

    With `serve` viewers come to that port on loopback; without `keep` there is no file.
    """

    def __init__(
        self,
        folder: Path,
        endpoint: str,
        run_id: str,
        *,
        serve: int | None = None,
        keep: bool = True,
    ) -> None:
        options = [] if serve is None else ["--serve", str(serve)]
        options += [] if keep else ["--no-file"]
        with (folder / "recorder.txt").open("ab") as log:
            self.child = Child(
                "mavherd.gcs.recording.recorder",
                [str(folder), endpoint, run_id, *options],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
            )
        self._whole, self._part = folder / "run.rrd", folder / "run.rrd.part"
        self._serves = serve is not None
        self._keeps = keep
        self._is_told = False  # to finish
        self._said: list[str] = []
        self._torn = b""
        self._killed = ""  # why it was we who ended it

    @property
    def ended(self) -> bool:
        """Whether the process is gone."""
        return self.child.wait(0) is not None

    def wait_ready(self, timeout: float) -> bool:
        """Return whether it has come up within `timeout` seconds."""
        return self._hears("ready", timeout)

    def wait_serving(self, timeout: float) -> bool:
        """Return whether viewers may come, within `timeout` seconds."""
        return self._hears("serving", timeout)

    @property
    def loss(self) -> str:
        """Why the recording is not whole; empty when it is, or goes on."""
        self._listen(0.0)
        told = [
            line for line in self._said if line.startswith("lost ") and not line.startswith(_SHOW)
        ]
        if not told and ("done" in self._said or not self.ended):
            return ""
        if told:
            reason = f"the recorder gave up: {told[0].removeprefix('lost ')}"
        elif self._killed:
            reason = f"the recorder {self._killed}"
        else:
            reason = f"the recorder {how_it_ended(self.child.wait(0))}"
        if not self._keeps:
            return reason
        if self._whole.exists():  # it was only to be made smaller
            return ""
        with suppress(OSError):
            if self._part.stat().st_size:
                return f"{reason}: run.rrd.part holds what came before"
        return f"{reason}: there is no run.rrd; see recorder.txt"

    @property
    def show_loss(self) -> str:
        """Why viewers can come no more though all is recorded; empty as long as they can."""
        self._listen(0.0)
        return next((line.removeprefix(_SHOW) for line in self._said if line.startswith(_SHOW)), "")

    def finish(self, *, hurry: bool) -> None:
        """Have it finish the recording, and wait for nothing; in a hurry it stays large."""
        stdin = self.child.process.stdin
        if self._is_told or stdin is None or stdin.closed:
            return
        self._is_told = True
        with suppress(OSError):
            os.write(stdin.fileno(), b"hurry\n" if hurry else b"finish\n")

    def close(self, timeout: float, interrupted: Callable[[], bool], hurry: float) -> None:
        """Have it finish the recording; afterwards it is gone, unless it serves viewers.

        An interrupt leaves it `hurry` seconds, and none when it was not up yet.
        """
        self.finish(hurry=interrupted())
        deadline = time.monotonic() + timeout
        while not interrupted() and time.monotonic() < deadline:
            if self._hears("done", _SLICE_S) or self.ended:
                break
        if interrupted():
            self._hears("done", hurry if self.wait_ready(0.0) else 0.0)
        if "done" in self._said and self._serves and not self.show_loss:
            return
        if "done" not in self._said and not self.ended:
            in_time = f"was not done after {timeout:.0f} s and was killed"
            self.kill("was cut short by the interrupt" if interrupted() else in_time)
        self.dismiss()

    def kill(self, why: str) -> None:
        """End it at once, and say why it had to be."""
        self._killed = why
        self.child.kill()
        self.child.end()

    def dismiss(self) -> None:
        """End it, though viewers may still be there."""
        if (stdin := self.child.process.stdin) and not stdin.closed:
            with suppress(OSError):
                stdin.close()
        self.child.end(_GONE_S)
        self._listen(0.0)
        if self.child.process.stdout:
            self.child.process.stdout.close()

    def _hears(self, word: str, timeout: float) -> bool:
        """Return whether it says, or has said, a word within `timeout` seconds."""
        deadline = time.monotonic() + timeout
        self._listen(0.0)
        while word not in self._said:
            left = deadline - time.monotonic()
            if left <= 0 or not self._listen(left):
                return word in self._said
        return True

    def _listen(self, timeout: float) -> bool:
        """Take in what it says within `timeout` seconds; return whether it can say more."""
        stdout = self.child.process.stdout
        if stdout is None or stdout.closed:
            return False
        while select.select([stdout], [], [], timeout)[0]:
            if not (data := os.read(stdout.fileno(), 4096)):
                return False
            *lines, self._torn = (self._torn + data).split(b"\n")
            self._said += [line.decode("utf-8", "replace") for line in lines]
            timeout = 0.0
        return True
