"""A run's verdict as JUnit XML, for the CI systems that read it."""

import platform
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ...transport.errors import MavherdError

_ENDED = "the run ends properly"
_GOOD_ENDS = (0, 1)  # exit codes: whether the assertions hold is told apart
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_PROPERTIES = ("run_id", "seed", "law", "digest", "exit_code", "partial", "version", "platform")
_LIMITS = "expected", "actual"


@contextmanager
def junit_file(path: Path | None, name: str) -> Iterator[Callable[[Mapping[str, Any]], None]]:
    """Write `path` at the end of the block, whatever ends it; yield what takes the run's report.

    Without a report the file tells of an error of the run `name`. Raises MavherdError at once when
    the file cannot be written; None writes nothing. It appears under its name when it is complete.
    """
    if path is None:
        yield lambda report: None
        return
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir():
            raise MavherdError(f"--junit {path}: this is a folder (name a file in it)")
        part.touch()
    except OSError as error:
        raise MavherdError(
            f"--junit {path}: cannot write there: {error.strerror} (name another place)"
        ) from None
    told: list[Mapping[str, Any]] = []
    failure = "the run was not carried out"
    try:
        yield told.append
    except BaseException as error:
        failure = str(error) or type(error).__name__
        raise
    finally:
        _write(part, path, junit(told[-1]) if told else junit_of_failure(name, failure))


def junit(report: Mapping[str, Any]) -> str:
    """Return a suite with a test case for how the run ended and one for each assertion."""
    name, wall_s = report["scenario"], report["wall_s"] or 0.0
    suite = _Suite(name, wall_s, report["started_at"])
    for key in _PROPERTIES:
        if (value := report[key]) is not None:
            suite.add_property(key, value)
    case = suite.add_case(_ENDED, wall_s)
    if report["error"] is not None or report["exit_code"] not in _GOOD_ENDS:
        code = report["exit_code"]
        suite.blame(case, "error", f"exit code {code}", report["error"] or f"exit code {code}")
    for each in report["assertions"]:
        case = suite.add_case(each["name"])
        if each["passed"] is None:
            suite.skip(case, each["text"])
        elif not each["passed"]:
            limits = (f"{key} {'nothing' if each[key] is None else each[key]}" for key in _LIMITS)
            suite.blame(case, "failure", "assertion", each["text"], *limits)
    return suite.text(out=f"run {report['run_id']}", err=report["missing"])


def junit_of_failure(name: str, error: str) -> str:
    """Return the suite of a run that has no report."""
    suite = _Suite(name, 0.0, None)
    suite.blame(suite.add_case(_ENDED), "error", "no report", error)
    return suite.text(out="", err=[error])


class _Suite:
    """One `testsuite` under way; attributes as the schemas of Jenkins and Ant want them."""

    def __init__(self, name: str, wall_s: float, started_at: str | None) -> None:
        moment = datetime.fromisoformat(started_at) if started_at else datetime.now(UTC)
        self._name = f"mavherd.{name}"
        self._counts = {"tests": 0, "failures": 0, "errors": 0, "skipped": 0}
        self._time = f"{wall_s:.3f}"
        self._element = Element(
            "testsuite",
            name=name,
            id="0",
            package="mavherd",
            hostname=platform.node() or "localhost",
            timestamp=moment.strftime("%Y-%m-%dT%H:%M:%S"),  # of UTC; a zone is not foreseen
            time=self._time,
        )
        self._properties = SubElement(self._element, "properties")

    def add_property(self, name: str, value: object) -> None:
        SubElement(self._properties, "property", name=name, value=_clean(str(value)))

    def add_case(self, name: str, wall_s: float = 0.0) -> Element:
        self._counts["tests"] += 1
        about = {"name": _clean(name), "classname": self._name, "time": f"{wall_s:.3f}"}
        return SubElement(self._element, "testcase", about)

    def blame(self, case: Element, kind: str, reason: str, text: str, *more: str) -> None:
        """Say that a case has a `failure` or an `error`."""
        self._counts[kind + "s"] += 1
        fault = SubElement(case, kind, type=reason, message=_clean(text))
        fault.text = _clean("\n".join([text, *more]))

    def skip(self, case: Element, text: str) -> None:
        """Say that a case was not decided."""
        self._counts["skipped"] += 1
        SubElement(case, "skipped", message=_clean(text))

    def text(self, *, out: str, err: list[str]) -> str:
        """Return the whole document."""
        SubElement(self._element, "system-out").text = _clean(out)
        SubElement(self._element, "system-err").text = _clean("\n".join(err))
        counts = {key: str(number) for key, number in self._counts.items()}
        skipped = {"skipped": counts.pop("skipped")}  # foreseen in a suite only
        self._element.attrib |= counts | skipped
        root = Element("testsuites", {"name": "mavherd", "time": self._time, **counts})
        root.append(self._element)
        indent(root)
        return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, "unicode") + "\n"


def _clean(text: str) -> str:
    """Return `text` without what XML cannot say."""
    return _NOT_XML.sub("\N{REPLACEMENT CHARACTER}", text)


def _write(part: Path, path: Path, text: str) -> None:
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as error:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise MavherdError(f"--junit {path}: cannot write it: {error.strerror}") from None
