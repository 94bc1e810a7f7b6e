"""TEST DOUBLE: a relay between one real `mavherd vehicle` process and a ground station.

What passes is changed as `Manners` say, so that the far end seems to be a real autopilot:

    with vehicle_double(folder, "quadcopter", Manners(arming_refused_s=5)) as double:
        ... connect: double.address ...
"""

import os
import re
import select
import signal
import socket
import subprocess
import sys
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from manners import Actor, Manners

from mavherd.transport.mavlink import Codec, Message, mav

HOST = "127.0.0.1"
HOME = "47.3977,8.5456,488,0"  # the fleet origin of a scenario that names none
PATIENCE = 60.0
_START_S = 60.0
_PILOT = 255, 190  # who speaks when a pilot takes over
_TURN_S = 0.02


class VehicleDouble:
    """One vehicle process and the relay before it; `actor` says how it is meanwhile."""

    def __init__(
        self,
        folder: Path,
        kind: str,
        manners: Manners,
        *,
        system_id: int = 1,
        autopilot: str = "ardupilot",
        position: tuple[float, float, float] = (0.0, 0.0, 0.0),  # ENU, from the fleet origin
        home: str = HOME,
        link: str = "tcp",  # how the ground connects: tcp | udpin | udpout | serial
        port: int = 0,  # with udpin: where the ground listens; else: ours, 0 any
        options: tuple[object, ...] = (),
        clock: Callable[[], float] = time.monotonic,  # of the manners
    ) -> None:
        self._clock = clock
        self.actor = Actor(manners, kind, autopilot)
        self.system_id = system_id
        self._link = link
        self._is_stream = link in ("tcp", "serial")
        self._process, vehicle_port = _start(
            folder / f"double{system_id}-{time.monotonic_ns()}.txt",
            kind,
            *("--sysid", system_id, "--autopilot", autopilot, "--home", home),
            *("--position", ",".join(map(str, position)), *options),
        )
        self._vehicle = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._vehicle.connect((HOST, vehicle_port))
        self._from_vehicle = Codec(system_id)  # and what it packs for the ground
        self._to_vehicle: dict[tuple[int, int], Codec] = {}  # by sender
        self._listening, self._ground, self._ground_at = self._open(port)
        self._from_ground = Codec(*_PILOT)
        self._began: float | None = None
        self._stop = threading.Event()
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name=f"double {system_id}")
        self._thread.start()

    @property
    def address(self) -> str:
        """What a scenario writes after `connect:`."""
        if self._link == "serial":
            return f"serial:{self._device}"
        return f"{self._link}:{HOST}:{self._port}"

    @property
    def now(self) -> float:
        """Seconds since the ground's first word."""
        return 0.0 if self._began is None else self._clock() - self._began

    def wait_until(self, condition, what: str, patience: float = PATIENCE) -> None:
        """Return as soon as `condition(actor)` is true."""
        deadline = time.monotonic() + patience
        while not condition(self.actor):
            assert self._failure is None, self._failure
            assert time.monotonic() < deadline, f"{what}: not within {patience:g} s"
            time.sleep(0.02)

    def close(self) -> None:
        """End relay and vehicle."""
        self._stop.set()
        self._thread.join()
        self._process.send_signal(signal.SIGTERM)
        try:
            self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        for sock in (self._vehicle, self._listening, self._ground):
            if sock:
                sock.close()
        if self._failure:
            raise self._failure

    def _open(self, port: int):
        """Return the listening socket, the socket to the ground, and where on UDP that is."""
        if self._link == "tcp":
            listening = socket.create_server((HOST, port))
            self._port = listening.getsockname()[1]
            return listening, None, None
        if self._link == "serial":
            ground = _Pty()
            self._device = ground.device
            return None, ground, None
        ground = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        ground.bind((HOST, port if self._link == "udpout" else 0))
        self._port = port if self._link == "udpin" else ground.getsockname()[1]
        return None, ground, (HOST, port) if self._link == "udpin" else None

    def _run(self) -> None:
        try:
            greet_at = 0.0
            while not self._stop.is_set():
                if time.monotonic() >= greet_at:  # vehicles speak to those who have spoken
                    greet_at = time.monotonic() + 1
                    beat = mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
                    self._send_up([beat], _PILOT)
                open_sockets = [s for s in (self._vehicle, self._listening, self._ground) if s]
                ready, _, _ = select.select(open_sockets, [], [], _TURN_S)
                self._turn(ready)
        except BaseException as error:  # told by `close` in the test's own thread
            self._failure = error

    def _turn(self, ready: list[socket.socket]) -> None:
        if self.actor.hangs_up(self.now) and self._link == "tcp":
            self._hang_up()
            ready = [sock for sock in ready if sock.fileno() >= 0]
        up, down = self.actor.tick(self.now)
        self._send_up(up, _PILOT)
        self._send_down(down)
        if self._listening in ready:
            self._hang_up()
            self._ground, _ = self._listening.accept()
            self._from_ground = Codec(*_PILOT)
            self.actor.connected()
        if self._vehicle in ready:
            self._hear_vehicle()
        if self._ground and self._ground in ready:
            self._hear_ground()

    def _hear_vehicle(self) -> None:
        with suppress(OSError):  # gone, or not started yet
            data = self._vehicle.recv(65536)
            for message in self._from_vehicle.decode(data, stream=False):
                self._send_down(self.actor.from_vehicle(message, self.now))

    def _hear_ground(self) -> None:
        data = b""
        with suppress(OSError):
            if self._is_stream:
                data = self._ground.recv(65536)
            else:
                data, self._ground_at = self._ground.recvfrom(65536)
        if not data:
            if self._link == "tcp":
                self._hang_up()
            return
        if self._began is None:
            self._began = self._clock()
        if self.actor.is_silent(self.now):
            return
        for message in self._from_ground.decode(data, stream=self._is_stream):
            sender = message.get_srcSystem(), message.get_srcComponent()
            up, down = self.actor.from_ground(message, self.now)
            self._send_up(up, sender)
            self._send_down(down)

    def _send_up(self, messages: list[Message], sender: tuple[int, int]) -> None:
        codec = self._to_vehicle.setdefault(sender, Codec(*sender))
        for message in messages:
            with suppress(OSError):
                self._vehicle.send(codec.encode([message]))

    def _send_down(self, messages: list[Message]) -> None:
        data = self._from_vehicle.encode(messages)
        if not data or self._ground is None or self.actor.is_silent(self.now):
            return
        with suppress(OSError):
            if self._is_stream:
                self._ground.sendall(data)
            elif self._ground_at:
                self._ground.sendto(data, self._ground_at)

    def _hang_up(self) -> None:
        if self._ground:
            self._ground.close()
        self._ground = None


class _Pty:
    """The vehicle's end of a serial cable, used like a socket; the other end is a device."""

    def __init__(self) -> None:
        self._far, self._near = os.openpty()  # the near end stays open: no hang-up between users
        tty.setraw(self._near)
        os.set_blocking(self._far, False)
        self.device = os.ttyname(self._near)

    def fileno(self) -> int:
        return self._far

    def recv(self, count: int) -> bytes:
        return os.read(self._far, count)

    def sendall(self, data: bytes) -> None:
        os.write(self._far, data)  # what nobody reads is lost, as on a wire

    def close(self) -> None:
        os.close(self._far)
        os.close(self._near)


@contextmanager
def vehicle_double(
    folder: Path, kind: str, manners: Manners | None = None, **options: object
) -> Iterator[VehicleDouble]:
    """Run a double for the length of a `with`."""
    double = VehicleDouble(folder, kind, manners or Manners(), **options)
    try:
        yield double
    finally:
        double.close()


def _start(log: Path, kind: str, *options: object) -> tuple[subprocess.Popen, int]:
    """Start the vehicle; return it and the UDP port where it answers."""
    words = ["vehicle", kind, "--tcp", 0, "--udpin", f"{HOST}:0", *options]
    with log.open("w") as out:
        process = subprocess.Popen(
            [sys.executable, "-m", "mavherd", *map(str, words)],
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
        )
    deadline = time.monotonic() + _START_S
    while process.poll() is None and time.monotonic() < deadline:
        if found := re.search(rf"udpin:{HOST}:(\d+)[,\s]", log.read_text()):
            return process, int(found[1])
        time.sleep(0.01)
    process.kill()
    process.wait()
    raise AssertionError(f"no vehicle: {log.read_text()}")
