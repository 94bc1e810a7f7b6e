"""JUnit XML says what the report says, in the form that CI systems read."""

import xml.etree.ElementTree as ET

import pytest

from mavherd.gcs.report.junit import junit, junit_file
from mavherd.transport.errors import MavherdError, VehicleError

REPORT = {
    "run_id": "two-1",
    "started_at": "2026-03-01T10:20:30Z",
    "scenario": "two",
    "seed": 7,
    "law": "safe",
    "digest": "ab" * 32,
    "exit_code": 1,
    "error": None,
    "partial": False,
    "missing": [],
    "version": "1.0",
    "platform": "Linux",
    "wall_s": 1.25,
    "assertions": [
        {
            "name": "collisions",
            "expected": 0,
            "actual": 2,
            "passed": False,
            "text": "no collision: 2",
        },
        {
            "name": "min_separation_m",
            "expected": 0.5,
            "actual": 0.7,
            "passed": True,
            "text": "all stay <0.5> m apart & more",
        },
    ],
}
# What both the schema of Jenkins and that of Ant ask for
REQUIRED = {
    "testsuite": {"name", "tests", "failures", "errors", "time", "timestamp", "hostname"},
    "testcase": {"name", "classname", "time"},
    "property": {"name", "value"},
    "failure": {"type", "message"},
    "skipped": {"message"},
    "error": {"type", "message"},
}
CHILDREN = {
    "testsuites": ["testsuite"],
    "testsuite": ["properties", "testcase", "system-out", "system-err"],
    "properties": ["property"],
    "testcase": ["skipped", "failure", "error"],
}


def read(text):
    """Return the suite in `text`, which has the structure of the schemas."""
    root = ET.fromstring(text)
    assert root.tag == "testsuites"
    for element in root.iter():
        assert element.attrib.keys() >= REQUIRED.get(element.tag, set())
        order = [CHILDREN[element.tag].index(child.tag) for child in element]
        assert order == sorted(order)
    (suite,) = root
    for counted, path in (
        ("tests", "testcase"),
        ("failures", "testcase/failure"),
        ("errors", "testcase/error"),
    ):
        assert int(suite.get(counted)) == int(root.get(counted)) == len(suite.findall(path))
    assert int(suite.get("skipped")) == len(suite.findall("testcase/skipped"))
    return suite


def test_each_assertion_is_a_case_and_so_is_a_proper_end():
    suite = read(junit(REPORT))
    cases = {case.get("name"): case for case in suite.findall("testcase")}
    assert list(cases) == ["the run ends properly", "collisions", "min_separation_m"]
    assert [len(case) for case in cases.values()] == [0, 1, 0]
    fault = cases["collisions"][0]
    assert (fault.tag, fault.get("message")) == ("failure", "no collision: 2")
    assert "actual 2" in fault.text
    assert float(suite.get("time")) == float(cases["the run ends properly"].get("time")) == 1.25
    assert suite.get("timestamp") == "2026-03-01T10:20:30"
    properties = {p.get("name"): p.get("value") for p in suite.iter("property")}
    assert (properties["seed"], properties["law"]) == ("7", "safe")
    assert properties["digest"] == REPORT["digest"]


def test_a_run_that_was_broken_off_is_an_error_beside_its_assertions():
    report = REPORT | {"exit_code": 4, "error": "timed out", "missing": ["tlog: none of r1"]}
    suite = read(junit(report))
    (error,) = suite.findall("testcase/error")
    assert (error.get("type"), error.text) == ("exit code 4", "timed out")
    assert suite.get("failures") == "1"
    assert suite.find("system-err").text == "tlog: none of r1"


def test_an_assertion_that_was_not_decided_is_skipped():
    still_open = {"name": "min_separation_m", "passed": None, "text": "0.7 m by then"}
    suite = read(junit(REPORT | {"assertions": [still_open]}))
    (skipped,) = suite.findall("testcase/skipped")
    assert skipped.get("message") == "0.7 m by then"
    assert (suite.get("failures"), suite.get("skipped")) == ("0", "1")


def test_what_xml_cannot_say_is_left_out():
    suite = read(junit(REPORT | {"exit_code": 3, "error": "bell \x07, \x1b[31mred <&> \ud800"}))
    assert suite.find("testcase/error").text == "bell \ufffd, \ufffd[31mred <&> \ufffd"


def test_the_file_is_there_when_the_run_has_ended_however_that_was(tmp_path):
    path = tmp_path / "new" / "run.xml"
    with junit_file(path, "two") as tell:
        assert not path.exists()
        tell(REPORT)
    assert read(path.read_text()).get("failures") == "1"
    for failure in (VehicleError("r1 could not start"), KeyboardInterrupt()):
        with pytest.raises(type(failure)), junit_file(path, "two"):
            raise failure
        (error,) = read(path.read_text()).findall("testcase/error")
        assert error.text == (str(failure) or "KeyboardInterrupt")
    assert [file.name for file in path.parent.iterdir()] == ["run.xml"]


def test_a_place_that_cannot_be_written_is_refused_at_once(tmp_path):
    file = tmp_path / "file"
    file.touch()
    for place in (tmp_path, file / "below.xml"):
        with pytest.raises(MavherdError, match="--junit"), junit_file(place, "two"):
            pytest.fail("the run was begun")


def test_without_a_file_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with junit_file(None, "two") as tell:
        tell(REPORT)
    assert list(tmp_path.iterdir()) == []
