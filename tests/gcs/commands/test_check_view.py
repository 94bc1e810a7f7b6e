"""The same findings for a terminal, for a file, for a program: nothing missing is left out."""

import io
import json

from rich.console import Console

from mavherd.gcs.commands.check_view import as_json, lines, progress, summary, table
from mavherd.gcs.commands.live_check import Finding
from mavherd.gcs.safety.preflight import Check
from mavherd.scenarios.schema import Point, RobotSpec

CURE = "move it to east 0, north 0"


def finding(name, *checks):
    spec = RobotSpec(
        name=name, kind="rover", system_id=7, start=Point(0, 0), connect="tcp:127.0.0.1:5760"
    )
    return Finding(spec, list(checks))


READY = finding("a", Check("link", True, "heartbeat 0.1 s ago", "not to be shown"))
FINDINGS = [
    READY,
    finding(
        "b",
        Check("link", True, "heartbeat 0.2 s ago"),
        Check("origin", None, "not told yet"),
        Check("place", False, "stands elsewhere", CURE),
        Check("fence", False, "its own is off", "switch it on", required=False),
    ),
    finding("c", Check("link", False, "nothing heard"), Check("place", None, "")),
]


def shown(renderable):
    console = Console(file=io.StringIO(), width=100)
    console.print(renderable)
    return console.file.getvalue()


def test_while_it_waits_only_what_is_missing_is_shown():
    text = shown(progress(FINDINGS, 12.4))
    assert [line.split() for line in text.splitlines()] == [
        ["a", "ready"],
        ["b", "missing", "place", "stands", "elsewhere"],
        ["c", "missing", "link", "nothing", "heard"],
        ["waiting,", "12", "s", "left"],
    ]


def test_at_the_end_everything_is_told_with_the_cure_of_what_is_wrong():
    for text in (shown(table(FINDINGS)), "\n".join(lines(FINDINGS))):
        rows = [line.split() for line in text.splitlines()]
        assert ["ok", "link", "heartbeat", "0.2", "s", "ago"] in rows
        assert ["waiting", "origin", "not", "told", "yet"] in rows
        assert ["missing", "place", "stands", "elsewhere"] in rows
        assert ["note", "fence", "its", "own", "is", "off"] in rows
        assert rows.count(CURE.split()) == 1
        assert "not to be shown" not in text
        assert rows[-1] == ["missing", "link", "nothing", "heard"]  # nothing is known of its place


def test_one_line_says_who_waits_for_what():
    assert summary(FINDINGS) == "b (place); c (link)"
    assert summary([READY]) == ""


def test_a_program_gets_all_of_it():
    found = json.loads(json.dumps(as_json("field", FINDINGS)))
    assert (found["scenario"], found["ready"]) == ("field", False)
    assert [v["ready"] for v in found["vehicles"].values()] == [True, False, False]
    assert found["vehicles"]["b"]["checks"][2]["cure"] == CURE
