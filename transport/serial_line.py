"""A vehicle at a serial port or a telemetry radio. The only module that imports pyserial."""

import os
import select
import socket
import termios
import time
from collections.abc import Callable, Iterator
from typing import Any

from .connect import Address
from .errors import LinkError
from .links import Link
from .retry import Backoff

_READ = 4096
_READS = 16  # before the caller gets a turn


class SerialLine:
    """Opens a serial device; opens it again when it has vanished and come back.

    pyserial opens the device and sets its speed. Bytes go past it: its non-blocking write waits
    for a device that takes nothing.
    """

    stream = True
    paused = False

    def __init__(self, address: Address, clock: Callable[[], float] = time.monotonic) -> None:
        self.label = f"serial:{address.device}:{address.baud}"
        self.spoken = False
        self.open = True  # the conversation outlives an unplugged device
        self.problem = ""
        self._address = address
        self._serial_class = _import_pyserial(self.label)
        self._backoff = Backoff(clock)
        self._serial: Any = None
        self._unsent = b""
        self._try_to_open()

    @property
    def congested(self) -> bool:
        """Whether the device has not taken all that was sent to it."""
        return bool(self._unsent)

    def sockets(self) -> list[socket.socket]:
        """Return the device, which is waited for like a socket, if it is open."""
        return [self._serial] if self._serial else []

    def links(self) -> list[Link]:
        """Return the one conversation."""
        return [self]

    def send(self, data: bytes) -> None:
        """Send `data` whole; drop it while the device takes nothing."""
        self._write(b"" if self._unsent else data)

    def receive(self) -> Iterator[tuple[Link, bytes]]:
        """Yield what has arrived; open the device again when it is time to."""
        self._write(b"")
        if not self._serial and self._backoff.is_over():
            self._try_to_open()
        for _ in range(_READS):
            if not self._serial or not (data := self._read()):
                return
            self._backoff.reset()
            yield self, data

    def close(self) -> None:
        """Close the device."""
        self.open = False
        self._hang_up()

    def _try_to_open(self) -> None:
        try:
            # exclusive: bytes that two programs share are of use to neither
            self._serial = self._serial_class(
                self._address.device, self._address.baud, timeout=0, exclusive=True
            )
            self.problem = ""
        except (OSError, ValueError) as error:  # SerialException is an OSError
            self._fail(_reason(error))
        except termios.error as error:  # it has vanished in the middle of this
            self._fail(_reason(OSError(*error.args)))

    def _read(self) -> bytes:
        """Return what has arrived, nothing when the device is quiet or gone."""
        poll = select.poll()
        poll.register(self._serial.fileno(), select.POLLIN)
        events = dict(poll.poll(0)).get(self._serial.fileno(), 0)
        try:
            data = os.read(self._serial.fileno(), _READ) if events & select.POLLIN else b""
        except BlockingIOError:
            return b""
        except OSError as error:
            self._fail(_reason(error))
            return b""
        if events and not data:  # a tty that is readable, but holds nothing, has hung up
            self._fail("the device has vanished")
        return data

    def _write(self, data: bytes) -> None:
        self._unsent += data
        if not self._serial or not self._unsent:
            self._unsent = b""
            return
        try:
            self._unsent = self._unsent[os.write(self._serial.fileno(), self._unsent) :]
        except BlockingIOError:
            pass
        except OSError as error:
            self._fail(_reason(error))

    def _hang_up(self) -> None:
        if self._serial:
            self._serial.close()
        self._serial = None
        self._unsent = b""

    def _fail(self, problem: str) -> None:
        self._hang_up()
        self.problem = problem
        self._backoff.fail()


def _import_pyserial(label: str) -> Any:
    try:
        import serial
    except ImportError:
        cure = "pip install 'mavherd[serial]'"
        raise LinkError(f"{label}: serial ports need pyserial ({cure})") from None
    return serial.Serial


def _reason(error: OSError | ValueError) -> str:
    """Return why a device does not serve, with the cure where there is one."""
    match error:
        case FileNotFoundError() | OSError(errno=2):
            return "no such device (plugged in, and powered?)"
        case PermissionError() | OSError(errno=13):
            return "permission denied (may this user use serial ports: group dialout?)"
        case OSError(errno=11):
            return "in use by another program"
        case OSError(errno=5):
            return "the device has vanished"
        case OSError(strerror=str(text)):
            return text.lower()
    return str(error).lower()
