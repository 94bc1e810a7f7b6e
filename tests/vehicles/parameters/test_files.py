"""Parameter files of all three ground stations are read; what is kept is what users changed."""

import pytest

from mavherd.vehicles.config import KINDS, VehicleConfig
from mavherd.vehicles.parameters.files import ParameterFileError, fit, load, save, write
from mavherd.vehicles.parameters.store import Parameters

COPTER = VehicleConfig(kind="quadcopter", system_id=1)


@pytest.fixture
def file(tmp_path):
    def make(content, name="tuned.param"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return make


@pytest.mark.parametrize(
    "text",
    [
        "#NOTE: Mission Planner\r\nRTL_ALT,2000\r\nGUID_TIMEOUT,0.5\r\n",
        "RTL_ALT          2000\nGUID_TIMEOUT     0.500000  # MAVProxy\n\n",
        "# Onboard parameters\n1\t1\tRTL_ALT\t2000\t6\n1\t1\tGUID_TIMEOUT\t0.5\t9\n",
        "\ufeffRTL_ALT, 0x7D0\nGUID_TIMEOUT 5e-1",
        "RTL_ALT 1\nGUID_TIMEOUT 0.5\nRTL_ALT 2000\n",  # the last counts
    ],
)
def test_every_ground_stations_form_is_read(file, text):
    assert load(file(text)) == {"RTL_ALT": 2000, "GUID_TIMEOUT": 0.5}


def test_an_empty_file_says_nothing(file):
    assert load(file("")) == load(file("# only a comment\n\n")) == {}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("RTL_ALT,2000\nRTL_ALT\n", r"tuned.param:2: 'RTL_ALT' is no parameter \(expected NAME"),
        ("RTL_ALT,1,2\n", r":1: 'RTL_ALT 1 2' is no parameter"),
        ("RTL_ALT,high\n", r":1: RTL_ALT is 'high', which is no number"),
        ("RTL_ALT,nan\n", r":1: RTL_ALT is 'nan'"),
        ("RTL_ALT,1e999\n", r":1: RTL_ALT is '1e999'"),
        (f"RTL_ALT,0x{'f' * 400}\n", r":1: RTL_ALT is '0xf"),
        ("RTL-ALT,1\n", r":1: 'RTL-ALT' is no name"),
        ("A_NAME_OF_17_CHRS,1\n", r":1: 'A_NAME_OF_17_CHRS' is no name"),
        ("ÄLT,1\n", r":1: 'ÄLT' is no name"),
        (b"\xff\xfe\x00", r"tuned.param: is not text"),
        (b"#" * 1_000_001, r"tuned.param: is too large"),
    ],
)
def test_a_bad_file_is_refused_with_its_line_and_the_cure(file, text, problem):
    with pytest.raises(ParameterFileError, match=problem):
        load(file(text))


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ParameterFileError, match=r"none.param: cannot be read: .*No such file"):
        load(tmp_path / "none.param")


def test_names_of_other_vehicles_are_told_apart_not_refused(file):
    path = file("RTL_ALT,2000.4\nQ_ENABLE,1\nFRAME_CLASS,2\nATC_RAT_RLL_P,0.1\nmass 1.3\n")
    assert fit(path, COPTER) == (
        {"RTL_ALT": 2000, "mass": 1.3},
        ["Q_ENABLE", "FRAME_CLASS", "ATC_RAT_RLL_P"],
    )


def test_a_value_that_cannot_be_is_refused_with_its_line(file):
    with pytest.raises(ParameterFileError, match=r"tuned.param:2: RTL_ALT: -5 is not within"):
        fit(file("#\nRTL_ALT,-5\n"), COPTER)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_written_is_read_back_the_same(tmp_path, kind, autopilot):
    config = VehicleConfig(kind=kind, system_id=1, autopilot=autopilot)
    values = {entry.parameter.name: entry.value for entry in Parameters(config)}
    write(tmp_path / "all.param", values)
    assert load(tmp_path / "all.param") == pytest.approx(values, rel=1e-7)
    settable = fit(tmp_path / "all.param", config).values
    again = Parameters(VehicleConfig(kind=kind, system_id=1, autopilot=autopilot, params=settable))
    assert {entry.parameter.name: entry.value for entry in again} == values


def start(path):
    """Start a vehicle with what the file keeps, as the process shell does."""
    kept = fit(path, COPTER).values if path.exists() else {}
    p = Parameters(VehicleConfig(kind="quadcopter", system_id=1, params=kept))
    p.on_change = lambda: save(path, p)
    return p


def test_what_users_change_is_kept_and_nothing_else(tmp_path):
    path = tmp_path / "parameters.param"
    p = start(path)
    p.follow("MIS_TOTAL", lambda: 3)
    assert not path.exists()
    p.set("RTL_ALT", 2000)
    p.set("HERD_ATT_P", 100.1)
    assert path.read_text() == "RTL_ALT,2000\nHERD_ATT_P,100.1\n"
    p = start(path)
    assert (p["RTL_ALT"], p.settings.rtl_height) == (2000, 20)
    assert p.robot_overrides["roll_p"] == pytest.approx(100.1)
    p.set("LAND_SPEED", 60)
    assert load(path) == {"RTL_ALT": 2000, "HERD_ATT_P": 100.1, "LAND_SPEED": 60}
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_usual_again_is_forgotten(tmp_path):
    path = tmp_path / "parameters.param"
    p = start(path)
    p.set("RTL_ALT", 2000)
    p.set("LAND_SPEED", 60)
    p.set("RTL_ALT", 1500)
    assert load(path) == {"LAND_SPEED": 60}


def test_overrides_of_one_run_are_not_kept(tmp_path):
    path = tmp_path / "parameters.param"
    p = Parameters(VehicleConfig(kind="quadcopter", system_id=1, params={"RTL_ALT": 3000}))
    p.set("LAND_SPEED", 60)
    save(path, p)
    assert load(path) == {"LAND_SPEED": 60}


def test_a_folder_that_is_gone_is_named(tmp_path):
    p = start(tmp_path / "gone" / "parameters.param")
    with pytest.raises(ParameterFileError, match=r"parameters.param: cannot be written: .*No such"):
        p.set("RTL_ALT", 2000)
    assert p.settings.rtl_height == 20  # it counts all the same
