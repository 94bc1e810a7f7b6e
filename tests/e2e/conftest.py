"""Real processes, real sockets, stock clients: what the end-to-end tests share."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from itertools import cycle, islice
from pathlib import Path
from typing import Any

import jsonschema
import pytest

os.environ["MAVLINK20"] = "1"
from pymavlink import mavutil

DOCS = Path(__file__).parents[2] / "docs"
_PORT_OPTIONS = "--gcs-udp", "--api-udp", "--tcp"
_PATIENCE = 60.0  # s, for a condition on a machine that has other things to do
_HANGS_S = 280.0  # for a command: a little less than the patience of pytest
_STILL_S = 0.5  # of one turn of waiting; a machine that stands still for longer does so for all
_PORTS = range(20_000, 27_000, 20)  # nobody who asks for any gets one; tests/clients has others
_NEXT_PORT = cycle(_PORTS)
_TERMINAL = {"TERM": "xterm-256color"}  # whatever the tests themselves are run at
_NOT_OF_IT = {"COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"}

SCENARIO = """
name: {name}
duration: {duration}
team: {{start_sigma_m: 0}}
robots:
  - {{name: rover1, kind: rover, start: {{east: 0, north: 0}}, goto: {{east: {far}, north: 0}}}}
  - name: quad1
    kind: quadcopter
    start: {{east: 0, north: 4}}
    goto: {{east: {far}, north: 4, up: 1}}
expect: {{collisions: 0}}
"""


@dataclass(frozen=True)
class Finished:
    """What a command left behind."""

    code: int
    out: str
    err: str
    folder: Path | None  # of the run

    @property
    def report(self) -> dict[str, Any]:
        """What report.json says, which is as its schema says."""
        report = json.loads((self.folder / "report.json").read_text())
        schema = json.loads((DOCS / "report.schema.json").read_text())
        jsonschema.validate(report, schema, jsonschema.Draft202012Validator)
        return report

    @property
    def complaint(self) -> str:
        """The one line that says what was wrong."""
        (line,) = (line for line in self.err.splitlines() if line.startswith("mavherd: "))
        return line


class Sandbox:
    """Runs `python -m mavherd` in a folder of its own and finds every process that it started."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._started: list[subprocess.Popen] = []
        self._ports = ExitStack()
        self._tag = f"MAVHERD_TEST_RUN={uuid.uuid4().hex}"

    def start(self, *args: object, prefix: tuple[str, ...] = (), **popen: Any) -> subprocess.Popen:
        """Start a command; `prefix` runs before it. A run has only the ports that it is given."""
        if args[0] == "run":
            args += tuple(x for o in _PORT_OPTIONS if o not in args for x in (o, 0))
        name, _, value = self._tag.partition("=")
        given = {key: text for key, text in os.environ.items() if key not in _NOT_OF_IT}
        process = subprocess.Popen(
            [*prefix, sys.executable, "-m", "mavherd", *map(str, args)],
            cwd=self.folder,
            env={**given, **_TERMINAL, name: value},
            text=True,
            **{
                "stdin": subprocess.DEVNULL,
                "stdout": subprocess.PIPE,
                "stderr": subprocess.PIPE,
                **popen,
            },
        )
        self._started.append(process)
        return process

    def finish(self, process: subprocess.Popen, timeout: float = _HANGS_S) -> Finished:
        """Wait for a command's end; it must leave no process and no traceback."""
        out, err = process.communicate(timeout=timeout)
        assert self.processes() == {}, "processes are left behind"
        folder = self.run_folder()
        told = err or ""
        if folder:
            logs = [*folder.glob("*.txt"), *folder.glob("vehicles/*/log.txt")]
            told += "".join(log.read_text() for log in logs)
        assert "Traceback" not in told, told
        return Finished(process.returncode, out or "", err or "", folder)

    def run(self, *args: object, timeout: float = _HANGS_S, **popen: Any) -> Finished:
        """Run a command to its end."""
        return self.finish(self.start(*args, **popen), timeout)

    def run_folder(self) -> Path | None:
        """Return the newest run folder."""
        folders = sorted(self.folder.glob("runs/*"), key=lambda f: f.stat().st_mtime_ns)
        return folders[-1] if folders else None

    def scenario(self, name: str = "short", *, far: float = 2, duration: float = 60) -> str:
        """Write a scenario of one rover and one quadcopter that go `far`; return its file name."""
        text = SCENARIO.format(name=name, far=far, duration=duration)
        (self.folder / f"{name}.yaml").write_text(text)
        return f"{name}.yaml"

    def processes(self) -> dict[int, str]:
        """Return every living process of this sandbox: pid and command line."""
        found = {}
        for entry in Path("/proc").glob("[0-9]*"):
            with suppress(OSError):
                if self._tag.encode() in (entry / "environ").read_bytes():
                    words = (entry / "cmdline").read_bytes().split(b"\0")
                    found[int(entry.name)] = b" ".join(words).decode()
        return found

    def clock(self, *order: object) -> bool:
        """Order something of the newest run's clock; return whether that was granted."""
        folder = self.run_folder()
        return folder is not None and self.start("clock", folder, *order).wait(60) == 0

    def part(self, name: str) -> int:
        """Wait for a vehicle, or for nursery, coordinator or recorder; return the pid."""
        return self.wait_for(lambda: self._pid(name), f"the process of {name}")

    def _pid(self, name: str) -> int | None:
        module = {"coordinator": "coordinator_process"}.get(name, name)
        for pid, line in self.processes().items():
            if line.rpartition(" -m ")[2].startswith("mavherd.vehicles.nursery"):
                log = Path(f"/proc/{pid}/fd/1").resolve()  # a vehicle's is log.txt in its folder
                if name == (log.parent.name if log.name == "log.txt" else "nursery"):
                    return pid
            elif f".{module}" in line:
                return pid
        return None

    def wait_for_run(self, text: str = '"active"') -> Path:
        """Wait until an event of the run says `text`; return the run folder."""

        def said() -> Path | None:
            folder = self.run_folder()
            log = folder and folder / "events.jsonl"
            if log and log.exists() and text in log.read_text():
                return folder
            ended = self._started[-1].poll()
            assert ended is None, f"ended with {ended}: {self._started[-1].communicate()}"
            return None

        return self.wait_for(said, f"an event with {text}")

    def clean_up(self) -> None:
        """Kill what a failed test has left."""
        for pid in self.processes():
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        for process in self._started:
            process.communicate()
        self._ports.close()

    @staticmethod
    def wait_for(condition: Callable[[], Any], what: str, patience: float = _PATIENCE) -> Any:
        """Return what `condition` returns as soon as it is true."""
        left, turn = patience, time.monotonic()
        while not (value := condition()):
            assert left > 0, f"{what}: not within {patience:g} s"
            time.sleep(0.01)
            began, turn = turn, time.monotonic()
            left -= min(turn - began, _STILL_S)
        return value

    def free_port(self, kind: socket.SocketKind = socket.SOCK_STREAM) -> int:
        """Return a port that no other test has, with 19 more above it, while this sandbox lasts."""
        for port in islice(_NEXT_PORT, len(_PORTS)):
            token = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            try:
                token.bind(f"\0mavherd-test-port-{port}")  # a name, no file
                with socket.socket(socket.AF_INET, kind) as sock:
                    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                    sock.bind(("127.0.0.1", port))
            except OSError:
                token.close()
            else:
                self._ports.enter_context(token)
                return port
        raise AssertionError("no port is free")

    @staticmethod
    def connect(address: str) -> mavutil.mavfile:
        """Connect a stock client, as a ground station would."""
        return mavutil.mavlink_connection(address, source_system=255, retries=10)

    @staticmethod
    def greet(client: mavutil.mavfile) -> None:
        """Send the heartbeat of a ground station."""
        m = mavutil.mavlink
        client.mav.heartbeat_send(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, m.MAV_STATE_ACTIVE)


def _sandbox(folder: Path) -> Iterator[Sandbox]:
    sandbox = Sandbox(folder)
    try:
        yield sandbox
    finally:
        sandbox.clean_up()


@pytest.fixture
def sandbox(tmp_path: Path) -> Iterator[Sandbox]:
    """A folder to run commands in."""
    yield from _sandbox(tmp_path)


@pytest.fixture(scope="module")
def shared_sandbox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Sandbox]:
    """One folder for all tests of a module."""
    yield from _sandbox(tmp_path_factory.mktemp("shared"))


@pytest.fixture(scope="module")
def make_sandbox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str], Sandbox]]:
    """Make sandboxes, for commands of one module that run at the same time."""
    with ExitStack() as stack:

        def make(name: str) -> Sandbox:
            return stack.enter_context(contextmanager(_sandbox)(tmp_path_factory.mktemp(name)))

        yield make
