"""Parameter files as Mission Planner, MAVProxy and QGroundControl write them, and one kept.

Lines are `NAME,VALUE`, `NAME VALUE` or QGroundControl's five columns with tabs; `#` begins a
comment. Written files are `NAME,VALUE`, which the first two read.
"""

from collections.abc import Iterator, Mapping
from math import isfinite
from pathlib import Path
from typing import NamedTuple

from ...transport.errors import MavherdError
from ..config import VehicleConfig
from .parameter import NAME_LENGTH, ParameterRefused, shortest
from .profile import numbers
from .store import Parameters
from .tables import table

_LARGEST = 1_000_000  # bytes
_FORMS = "expected NAME,VALUE or NAME VALUE, or QGroundControl's five columns"


class ParameterFileError(MavherdError):
    """A parameter file that cannot be read or written. The text names file, line and cure."""


class Line(NamedTuple):
    """What one line of a file says."""

    number: int
    name: str
    value: float


class Fitted(NamedTuple):
    """What a file has for one vehicle, and the names in it that are not this vehicle's to set."""

    values: dict[str, float]
    foreign: list[str]


def load(path: Path) -> dict[str, float]:
    """Return the values in a file by name; raise ParameterFileError."""
    return {line.name: line.value for line in _lines(path)}


def fit(path: Path, config: VehicleConfig) -> Fitted:
    """Return what a file has for a vehicle; raise ParameterFileError.

    A file of a real autopilot holds a thousand names that this vehicle has no use for: they are
    told apart, not refused. A value that cannot be is refused.
    """
    known = {p.name: p for p in table(config.autopilot, config.kind, config.profile)}
    ours = numbers(config.kind, config.profile)
    fitted = Fitted({}, [])
    for line in _lines(path):
        if line.name in ours:
            fitted.values[line.name] = line.value
            continue
        parameter = known.get(line.name)
        if parameter is None or parameter.read_only:
            fitted.foreign.append(line.name)
            continue
        try:
            fitted.values[line.name] = parameter.stored(line.value)
        except ParameterRefused as reason:
            raise ParameterFileError(f"{path}:{line.number}: {reason}") from None
    return fitted


def save(path: Path, parameters: Parameters) -> None:
    """Keep what users have changed: update the file, dropping what is usual again.

    The file is replaced as a whole, so that no reader and no power cut meets half of it.
    """
    kept = load(path) if path.exists() else {}
    kept.update(parameters.touched())
    for name in [name for name in kept if name in parameters and parameters.is_usual(name)]:
        del kept[name]
    write(path, kept)


def write(path: Path, values: Mapping[str, float]) -> None:
    """Write values by name; raise ParameterFileError."""
    text = "".join(f"{name},{shortest(value)}\n" for name, value in values.items())
    beside = path.with_name(f"{path.name}.new")
    try:
        beside.write_text(text, encoding="ascii")
        beside.replace(path)
    except OSError as error:
        raise ParameterFileError(f"{path}: cannot be written: {error.strerror}") from None


def _lines(path: Path) -> Iterator[Line]:
    try:
        with path.open("rb") as file:
            data = file.read(_LARGEST + 1)
    except OSError as error:
        raise ParameterFileError(f"{path}: cannot be read: {error.strerror}") from None
    if len(data) > _LARGEST:
        raise ParameterFileError(f"{path}: is too large for a parameter file")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ParameterFileError(
            f"{path}: is not text (save it as a .param file in your ground station)"
        ) from None
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.partition("#")[0].replace(",", " ").split()
        if words:
            yield _line(f"{path}:{number}", number, words)


def _line(where: str, number: int, words: list[str]) -> Line:
    if len(words) == 5 and words[0].isdecimal() and words[1].isdecimal():
        words = words[2:4]
    if len(words) != 2:
        raise ParameterFileError(f"{where}: {' '.join(words)[:60]!r} is no parameter ({_FORMS})")
    name, text = words
    if not (name.isascii() and name.replace("_", "a").isalnum() and len(name) <= NAME_LENGTH):
        raise ParameterFileError(
            f"{where}: {name[:60]!r} is no name (letters, digits and _, at most {NAME_LENGTH})"
        )
    try:
        value = float(int(text, 16)) if text.lower().startswith("0x") else float(text)
    except (ValueError, OverflowError):
        value = float("nan")
    if not isfinite(value):
        raise ParameterFileError(f"{where}: {name} is {text[:60]!r}, which is no number")
    return Line(number, name, value)
