"""Real vehicle processes on free ports, and the stock clients that talk to them.

Clients run as scripts in processes of their own (`scripts/`), as their users run them: their
threads, log lines and warnings stay out of pytest. pymavlink alone is driven from here.
"""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest

from .ports import free_port

os.environ["MAVLINK20"] = "1"
from pymavlink import mavutil

mav = mavutil.mavlink
SCRIPTS = Path(__file__).parent / "scripts"
PATIENCE = 60.0  # s of wall clock, for an answer on a machine that has other things to do
_BUSY = 5  # attempts to find a port that stays free
_ROOM = 1 << 22  # bytes that may wait for a station; the system may allow less


class Vehicle:
    """One `mavherd vehicle` process with a TCP port, a UDP port, and a port that it sends to."""

    def __init__(self, folder: Path, kind: str, *options: object, speed: float = 1) -> None:
        self.log = folder / f"{kind}.log"
        for _ in range(_BUSY):  # a port that was free may be taken when the vehicle binds it
            tcp, self.udpout = free_port(socket.SOCK_STREAM), free_port(socket.SOCK_DGRAM)
            words = ["vehicle", kind, "--instance", 0, "--tcp", tcp, "--udpin", "127.0.0.1:0"]
            words += ["--udpout", f"127.0.0.1:{self.udpout}", "--speed", speed, *options]
            with self.log.open("w") as log:
                self.process = subprocess.Popen(
                    [sys.executable, "-m", "mavherd", *map(str, words)],
                    cwd=folder,
                    env={**os.environ, "PYTHONUNBUFFERED": "1"},
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                )
            if self._has_started():
                return
        pytest.fail(f"no vehicle: {self.log.read_text()}")

    def _has_started(self) -> bool:
        deadline = time.monotonic() + PATIENCE
        while self.process.poll() is None and time.monotonic() < deadline:
            said = self.log.read_text()
            if found := re.search(r"tcp:127.0.0.1:(\d+).* udpin:127.0.0.1:(\d+)", said):
                self.tcp, self.udpin = map(int, found.groups())
                return True
            time.sleep(0.02)
        self.process.kill()
        self.process.wait()
        return False

    def end(self) -> None:
        """Stop the process; it must have lived until now, without a complaint."""
        alive = self.process.poll() is None
        self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        said = self.log.read_text()
        assert alive, f"the vehicle ended on its own: {said}"
        assert self.process.returncode == 0, said
        assert "Traceback" not in said, said


class Station:
    """A ground station made of pymavlink: sends its heartbeat, waits for messages."""

    def __init__(self, address: str, system: int = 255, component: int = 190) -> None:
        self.link = mavutil.mavlink_connection(
            address, source_system=system, source_component=component, retries=10
        )
        self.link.port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _ROOM)
        self.system, self.component = system, component
        self.seen: list[Any] = []  # everything heard since the last `forget`
        self._greeted = 0.0
        self.greet()

    def greet(self, *, again: bool = False) -> None:
        """Send a heartbeat when the last one is a second old."""
        if again or time.monotonic() - self._greeted >= 1:
            self._greeted = time.monotonic()
            self.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))

    def send(self, *messages: Any) -> None:
        for message in messages:
            self.link.mav.send(message)

    @property
    def lost(self) -> int:
        """How many messages are missing by their numbers: what nobody reads in time, UDP drops."""
        return self.link.mav_loss

    def forget(self) -> None:
        self.seen.clear()

    def wait(
        self, *names: str, where: Callable[[Any], bool] = lambda m: True, patience: float = PATIENCE
    ) -> Any:
        """Return the next message of one of these types for which `where` is true."""
        deadline = time.monotonic() + patience
        while (left := deadline - time.monotonic()) > 0:
            m = self.link.recv_match(blocking=True, timeout=min(left, 0.2))
            self.greet()
            if m is None:
                continue
            self.seen.append(m)
            if m.get_type() in names and where(m):
                return m
        heard = sorted({m.get_type() for m in self.seen})
        pytest.fail(f"no {' or '.join(names)} within {patience:g} s, only {heard}")

    def ask(
        self, command: int, *params: float, form: str = "long", to: tuple[int, int] = (1, 1)
    ) -> int:
        """Send a command and return the result in its acknowledgement."""
        self.send(request(command, *params, form=form, to=to))
        return self.wait("COMMAND_ACK", where=lambda m: m.command == command).result

    def until_answered(self) -> list[Any]:
        """Return all that comes before the answer to a request that is always answered.

        Links keep the order of messages: what has not come by then will not come.
        """
        self.forget()
        self.ask(mav.MAV_CMD_GET_MESSAGE_INTERVAL, mav.MAVLINK_MSG_ID_HEARTBEAT, to=(0, 0))
        return list(self.seen)

    def named(self, name: str) -> list[Any]:
        """Return what has been heard of one type since the last `forget`."""
        return [m for m in self.seen if m.get_type() == name]

    def close(self) -> None:
        self.link.close()


def request(command: int, *params: float, form: str = "long", to: tuple[int, int] = (1, 1)) -> Any:
    """Return a COMMAND_LONG or COMMAND_INT."""
    p = (*params, *(0,) * (7 - len(params)))
    if form == "long":
        return mav.MAVLink_command_long_message(*to, command, 0, *p)
    x, y = int(p[4]), int(p[5])
    above_home = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT  # the only one that takeoffs are taken in
    return mav.MAVLink_command_int_message(*to, above_home, command, 0, 0, *p[:4], x, y, p[6])


def run_client(folder: Path, script: str, *args: object, patience: float = 400) -> dict[str, Any]:
    """Run a client's script to its end; return the facts it has written, one JSON object a line.

    Whatever processes it started end with it.
    """
    told = folder / "facts.jsonl"
    told.write_text("")
    client = subprocess.Popen(
        [sys.executable, "-W", "ignore", SCRIPTS / script, *map(str, args)],
        cwd=folder,
        env={**os.environ, "HOME": str(folder), "PYTHONUNBUFFERED": "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
    )
    try:
        said, _ = client.communicate(timeout=patience)
    except subprocess.TimeoutExpired:
        os.killpg(client.pid, signal.SIGKILL)
        said, _ = client.communicate()
        pytest.fail(f"{script} is not done after {patience:g} s:\n{said}\n{told.read_text()}")
    finally:
        with suppress(ProcessLookupError):
            os.killpg(client.pid, signal.SIGKILL)
        client.wait()
    assert client.returncode == 0, f"{script} failed:\n{said}\n{told.read_text()}"
    facts: dict[str, Any] = {}
    for line in told.read_text().splitlines():
        facts.update(json.loads(line))
    return facts


@pytest.fixture(scope="module")
def start(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Vehicle]]:
    """Start vehicles that live as long as the module: start("rover", "--sysid", 2, speed=3)."""
    with ExitStack() as stack:

        def begin(kind: str, *options: object, speed: float = 1) -> Vehicle:
            vehicle = Vehicle(tmp_path_factory.mktemp(kind), kind, *options, speed=speed)
            stack.callback(vehicle.end)
            return vehicle

        yield begin


def _connections() -> Iterator[Callable[..., Station]]:
    with ExitStack() as stack:

        def open_link(vehicle: Vehicle, how: str = "tcp", **identity: int) -> Station:
            address = {
                "tcp": f"tcp:127.0.0.1:{vehicle.tcp}",
                "udp": f"udpout:127.0.0.1:{vehicle.udpin}",  # we speak first
                "udp from vehicle": f"udpin:127.0.0.1:{vehicle.udpout}",  # it does
            }[how]
            station = Station(address, **identity)
            stack.callback(station.close)
            if how == "udp from vehicle":  # until it has been heard nobody knows where it is
                station.link.wait_heartbeat(timeout=PATIENCE)
                station.greet(again=True)
            return station

        yield open_link


@pytest.fixture(name="free_port", scope="session")
def _free_port() -> Callable[[socket.SocketKind], int]:
    """Find a port that nobody uses."""
    return free_port


@pytest.fixture
def connect() -> Iterator[Callable[..., Station]]:
    """Connect pymavlink to a vehicle: connect(vehicle, "udp")."""
    yield from _connections()


@pytest.fixture(scope="module")
def connect_once() -> Iterator[Callable[..., Station]]:
    """Connect as `connect` does, for all tests of a module."""
    yield from _connections()


@pytest.fixture(scope="module")
def run_once(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., dict[str, Any]]:
    """Run a client's script whose facts several tests look at."""

    def run_it(script: str, *args: object, **options: Any) -> dict[str, Any]:
        return run_client(tmp_path_factory.mktemp("client"), script, *args, **options)

    return run_it


@pytest.fixture
def run(tmp_path: Path) -> Callable[..., dict[str, Any]]:
    """Run a client's script in a folder of its own: run("mavproxy_copter.py", address)."""
    return lambda script, *args, **options: run_client(tmp_path, script, *args, **options)
