"""Where two runs part is found to the field, in fleet time, and said in words and as JSON."""

import hashlib
import json
from itertools import takewhile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.gcs.cli import main
from mavherd.gcs.diff.links import compare
from mavherd.gcs.diff.run_folder import Entry
from mavherd.transport.mavlink import Codec, mav
from mavherd.transport.tlog import TlogWriter
from mavherd.vehicles.config import SIMULATED_EPOCH_US

GROUND = 254, 190
IDS = {"rover1": 1, "quad1": 4}


def attitude(at, roll=0.5):
    return mav.MAVLink_attitude_message(round(at * 1e3), roll, 0.0, 0.0, 0.0, 0.0, 0.0)


def target(at, vx=0.412, vy=0.0):
    return mav.MAVLink_set_position_target_local_ned_message(
        round(at * 1e3), 1, 1, 1, 0, 0, 0, 0, vx, vy, 0, 0, 0, 0, 0, 0
    )


def heartbeat():
    return mav.MAVLink_heartbeat_message(10, 3, 0, 0, 4, 3)


class Link:
    """What one vehicle and the ground have said to one another, ready to be logged."""

    def __init__(self, system_id=1):
        self._vehicle, self._ground = Codec(system_id), Codec(*GROUND)
        self.entries = []

    def told(self, at, *messages):
        """The vehicle says something."""
        self.entries += [(at, frame) for frame in self._vehicle.frames(messages)]
        return self

    def asked(self, at, *messages):
        """The ground says something."""
        self.entries += [(at, frame) for frame in self._ground.frames(messages)]
        return self


def usual(ticks=5, system_id=1):
    """A link with telemetry and an answer at each tick."""
    link = Link(system_id)
    for k in range(1, ticks + 1):
        link.told(k / 20, attitude(k / 20)).asked(k / 20, target(k / 20))
    return link


def frames(link):
    return [frame for _, frame in link.entries]


def flown(folder, links, *, epoch=SIMULATED_EPOCH_US, seed=1, ended=True, **report):
    """Write what a run would leave."""
    folder.mkdir()
    robots = "".join(f"- {{name: {name}, system_id: {IDS[name]}}}\n" for name in links)
    (folder / "scenario.yaml").write_text(f"name: test\nseed: {seed}\nrobots:\n{robots}")
    for name, link in links.items():
        (folder / "vehicles" / name).mkdir(parents=True)
        log = TlogWriter(folder / "vehicles" / name / f"{name}.tlog")
        for at, frame in link.entries:
            log.write(epoch + round(at * 1e6), frame)
        log.close()
    if ended:
        said = b"".join(
            frame for name in sorted(links, key=IDS.get) for frame in frames(links[name])
        )
        digest = hashlib.sha256(said).hexdigest() if said else None
        facts = {"lockstep": True, "digest": digest, "ticks": len(said), **report}
        (folder / "report.json").write_text(json.dumps(facts))
    return folder


@pytest.fixture
def told(tmp_path, capsys):
    """Compare two sets of links; return exit code and lines."""

    def compare(a, b, options_a=None, options_b=None):
        run_a = flown(tmp_path / "a", a, **(options_a or {}))
        run_b = flown(tmp_path / "b", b, **(options_b or {}))
        code = main(["diff", str(run_a), str(run_b)])
        lines = capsys.readouterr().out.splitlines()
        assert lines[:2] == [f"A {run_a}", f"B {run_b}"]
        return code, lines[2:]

    return compare


def test_equal_runs_are_equal(told):
    two = {"rover1": usual(), "quad1": usual(system_id=4)}
    code, lines = told(two, two)
    bytes_of_all = b"".join([*frames(two["rover1"]), *frames(two["quad1"])])
    digest = hashlib.sha256(bytes_of_all).hexdigest()
    assert (code, lines) == (0, [f"equal: 2 vehicles, 20 messages, digest {digest[:16]}"])


def test_the_field_is_named_with_as_few_digits_as_tell_the_values_apart(told):
    a, b = usual(2), usual(2)
    a.told(3.45, attitude(3.4)).asked(3.45, target(3.45)).told(3.5, heartbeat())
    b.told(3.45, attitude(3.4)).asked(3.45, target(3.45, 0.409, 0.1)).told(3.5, heartbeat())
    code, lines = told({"rover1": a}, {"rover1": b})
    assert code == 1
    assert lines == [
        "rover1 at 3.45 s: SET_POSITION_TARGET_LOCAL_NED.vx (ground to vehicle): 0.412 | 0.409",
        "  also vy: 0 | 0.1",
        "  before: 5 messages of rover1 equal, the last:",
        "    0.10 s  ATTITUDE (vehicle to ground)",
        "    0.10 s  SET_POSITION_TARGET_LOCAL_NED (ground to vehicle)",
        "    3.45 s  ATTITUDE (vehicle to ground)",
    ]


def test_the_last_bit_of_a_float_is_seen(told):
    a = usual(1).told(1.0, attitude(1.0, 0.5))
    b = usual(1).told(1.0, attitude(1.0, 0.5 + 2**-24))
    _, lines = told({"rover1": a}, {"rover1": b})
    assert lines[0] == "rover1 at 1.00 s: ATTITUDE.roll (vehicle to ground): 0.5 | 0.50000006"


def test_values_that_print_alike_are_told_apart_by_their_bytes(told):
    a = usual(1).told(1.0, attitude(1.0, 0.0))
    b = usual(1).told(1.0, attitude(1.0, -0.0))
    _, lines = told({"rover1": a}, {"rover1": b})
    assert lines[0].endswith("ATTITUDE.roll (vehicle to ground): 0 | -0")


def test_what_vehicles_say_in_a_tick_comes_before_what_the_ground_answers(told):
    """The rover's target differs because the quadcopter moved: the quadcopter is the cause."""
    rovers = [Link().told(1.0, attitude(1.0)).asked(1.0, target(1.0, vx)) for vx in (0.4, 0.5)]
    quads = [Link(4).told(1.0, attitude(1.0, roll)) for roll in (0.1, 0.2)]
    runs = [{"rover1": r, "quad1": q} for r, q in zip(rovers, quads, strict=True)]
    _, lines = told(*runs)
    assert lines[0] == "quad1 at 1.00 s: ATTITUDE.roll (vehicle to ground): 0.1 | 0.2"
    assert lines[2:] == [
        "then part:",
        "  rover1 at 1.00 s: SET_POSITION_TARGET_LOCAL_NED.vx (ground to vehicle): 0.4 | 0.5",
    ]


def test_of_two_vehicles_that_part_in_one_tick_the_lower_system_id_is_first(told):
    a = {n: Link(i).told(1.0, attitude(1.0)) for n, i in IDS.items()}
    b = {n: Link(i).told(1.0, attitude(1.0, 0.6)) for n, i in IDS.items()}
    _, lines = told(a, b)
    assert lines[0].startswith("rover1 at 1.00 s")


def test_vehicles_that_never_part_are_named(told):
    a = {"rover1": usual(1).told(2.0, heartbeat()), "quad1": usual(system_id=4)}
    b = {"rover1": usual(1), "quad1": usual(system_id=4)}
    code, lines = told(a, b)
    assert code == 1
    assert lines[-1] == "equal to the end: quad1"


@pytest.mark.parametrize(("more", "run"), [(0, "A"), (1, "B")])
def test_a_message_that_one_run_lacks_is_named_and_not_its_neighbour(told, more, run):
    links = [usual(2), usual(2)]
    for k, link in enumerate(links):
        if k == more:
            link.told(0.15, heartbeat())
        link.told(0.15, attitude(0.15)).told(0.2, attitude(0.2))
    _, lines = told({"rover1": links[0]}, {"rover1": links[1]})
    assert lines[0] == f"rover1 at 0.15 s: HEARTBEAT (vehicle to ground) only in {run}"


def test_a_sequence_number_alone_is_a_difference(told):
    """What was lost on the way to the log shows in the numbers of what came after it."""
    a, b = Link(), Link()
    a.told(1.0, attitude(1.0))
    b.told(0.5, heartbeat()).told(1.0, attitude(1.0))
    del b.entries[0]
    _, lines = told({"rover1": a}, {"rover1": b})
    assert lines[0] == "rover1 at 1.00 s: ATTITUDE, sequence number (vehicle to ground): 0 | 1"


def test_a_message_in_another_tick_is_a_difference(told):
    a, b = Link().told(1.0, heartbeat()), Link().told(1.05, heartbeat())
    code, lines = told({"rover1": a}, {"rover1": b})
    assert code == 1
    assert lines[0] == "rover1 at 1.00 s: HEARTBEAT (vehicle to ground) at 1.00 s | at 1.05 s"


def test_messages_in_another_order_are_told_as_that(told):
    a = Link().told(1.0, heartbeat(), attitude(1.0))
    b = Link().told(1.0, attitude(1.0), heartbeat())
    _, lines = told({"rover1": a}, {"rover1": b})
    text = "rover1 at 1.00 s: HEARTBEAT | ATTITUDE (vehicle to ground), in the other order"
    assert lines[0] == text


def test_different_messages_in_one_place_are_both_named(told):
    a, b = Link().told(1.0, heartbeat()), Link().told(1.0, attitude(1.0))
    _, lines = told({"rover1": a}, {"rover1": b})
    assert lines[0] == "rover1 at 1.00 s: HEARTBEAT | ATTITUDE (vehicle to ground)"


def test_a_run_that_ended_earlier_is_told_as_that(told):
    _, lines = told({"rover1": usual(2)}, {"rover1": usual(5)})
    text = "rover1 at 0.15 s: A has ended; 6 more messages in B, first ATTITUDE (vehicle to ground)"
    assert lines[0] == text


def test_different_settings_are_said_first(told):
    link = {"rover1": usual()}
    code, lines = told(link, link, {"seed": 1}, {"seed": 2})
    assert lines[:2] == ["different scenarios:", "  seed: 1 | 2"]
    assert code == 0  # what matters is what was flown


def test_a_vehicle_that_one_run_lacks_makes_them_different(told):
    code, lines = told({"rover1": usual()}, {"rover1": usual(), "quad1": usual(system_id=4)})
    assert code == 1
    assert "only in B: quad1" in lines
    assert not [line for line in lines if "robots.quad1" in line]
    assert lines[-1] == "equal as far as both have the same vehicles: 10 messages"


def test_outside_clients_errors_and_other_machines_are_noted(told):
    link = {"rover1": usual()}
    a = {"outside_clients": 2, "python": "3.11.7"}
    _, lines = told(link, link, a, {"python": "3.13.0", "error": "quad1 died at 3.10 s"})
    assert lines[:3] == [
        "A: 2 outside clients took part, and may have steered",
        "B: ended with: quad1 died at 3.10 s",
        "python: 3.11.7 | 3.13.0",
    ]


def test_a_compiled_run_is_told_from_a_pure_one(told):
    link = {"rover1": usual()}
    _, lines = told(link, link, {"compiled": "compiled"}, {"compiled": "pure Python"})
    assert lines[0] == "compiled: compiled | pure Python"


def test_what_an_older_report_does_not_say_is_absent(told):
    link = {"rover1": usual()}
    _, lines = told(link, link, {"compiled": "pure Python"})
    assert lines[0] == "compiled: pure Python | -"


def test_runs_that_never_ticked_are_said_to_show_nothing(told):
    refused = {"error": "quad1: not ready"}
    code, lines = told({"rover1": Link()}, {"rover1": Link()}, refused, refused)
    assert code == 0
    said = "no messages in either run (they ended before the first tick): nothing is compared"
    assert said in lines
    assert lines[-1].startswith("equal: 1 vehicle, 0 messages")


def test_of_a_run_that_was_killed_what_there_is_is_compared(told, tmp_path):
    code, lines = told({"rover1": usual(2)}, {"rover1": usual(5)}, {"ended": False})
    assert code == 1
    assert lines[0] == "A: no report.json (it was killed, or goes on)"
    log = tmp_path / "a/vehicles/rover1/rover1.tlog"
    log.with_name("rover1.tlog.part").write_bytes(log.read_bytes()[:-3])  # torn
    log.unlink()
    assert main(["diff", str(tmp_path / "a"), str(tmp_path / "b")]) == 1


def test_a_torn_log_is_said_to_be_torn(told, tmp_path, capsys):
    told({"rover1": usual(2)}, {"rover1": usual(5)})
    log = tmp_path / "a/vehicles/rover1/rover1.tlog"
    log.with_name("rover1.tlog.part").write_bytes(log.read_bytes()[:-3])
    log.unlink()
    assert main(["diff", str(tmp_path / "a"), str(tmp_path / "b")]) == 1
    out = capsys.readouterr().out
    assert "A: logs without their end (.part): rover1" in out
    assert "rover1 at 0.10 s: A has ended; 7 more messages in B" in out


def test_free_runs_are_compared_by_contents_and_said_to_be_what_they_are(told):
    """Wall clocks stamp them, so times say nothing."""
    now = 1_800_000_000_000_000
    a = Link().told(0.0, heartbeat()).told(1.0, attitude(1.0))
    b = Link().told(0.0, heartbeat()).told(1.01, attitude(1.0, 0.6))
    _, lines = told(
        {"rover1": a},
        {"rover1": b},
        {"epoch": now, "ended": False},
        {"epoch": now + 7, "lockstep": False},
    )
    assert len([line for line in lines if "never equal byte for byte" in line]) == 2
    assert "rover1 at 1.00 s | 1.01 s: ATTITUDE.roll (vehicle to ground): 0.5 | 0.6" in lines


def test_where_a_clock_ran_free_nothing_is_called_missing_and_each_run_has_its_own_times(told):
    """A heartbeat comes sooner or later; the other run has it as well."""
    a = Link().told(0.05, heartbeat()).told(0.1, attitude(0.1)).told(1.05, heartbeat())
    b = Link().told(0.0, heartbeat()).told(0.02, heartbeat()).told(0.03, attitude(0.1))
    _, lines = told({"rover1": a}, {"rover1": b}, None, {"lockstep": False, "digest": None})
    assert lines[1:] == [
        "rover1 at 0.10 s | 0.02 s: ATTITUDE | HEARTBEAT (vehicle to ground)",
        "  before: 1 message of rover1 equal, the last:",
        "    0.05 s  HEARTBEAT (vehicle to ground)",
    ]


def test_what_went_before_is_told_by_the_clock_of_the_run_that_goes_on(told):
    a, b = Link().told(7.0, heartbeat()), Link().told(0.0, heartbeat()).told(1.0, attitude(1.0))
    _, lines = told({"rover1": a}, {"rover1": b}, None, {"lockstep": False, "digest": None})
    assert lines[1].startswith("rover1 at 1.00 s: A has ended")
    assert lines[-1] == "    0.00 s  HEARTBEAT (vehicle to ground)"


def test_runs_without_a_vehicle_in_common_are_not_called_equal(told):
    code, lines = told({"rover1": usual()}, {"quad1": usual(system_id=4)})
    assert code == 1
    assert lines[-1] == "no vehicle in common: nothing is compared"
    assert not [line for line in lines if line.startswith("equal")]


def cut(folder, missing):
    """Take so many bytes (None: all) off the end of a rover's log."""
    log = folder / "vehicles/rover1/rover1.tlog"
    log.write_bytes(log.read_bytes()[:-missing] if missing else b"")
    return log


ENTRY = 8 + len(frames(usual())[-1])


@pytest.mark.parametrize(
    ("missing", "said"),
    [
        (11, "rover1.tlog is torn at byte {last}, where the last message is cut short"),
        (None, "rover1.tlog is empty"),
        (ENTRY, "its logs give digest "),
    ],
)
def test_a_log_that_has_lost_its_end_is_said_first(tmp_path, capsys, missing, said):
    a = flown(tmp_path / "a", {"rover1": usual()})
    b = flown(tmp_path / "b", {"rover1": usual()}, seed=2)
    said = said.format(last=(b / "vehicles/rover1/rover1.tlog").stat().st_size - ENTRY)
    cut(b, missing)
    assert main(["diff", str(a), str(b)]) == 1
    assert capsys.readouterr().out.splitlines()[2].startswith(f"B: {said}")
    assert main(["diff", "--json", str(a), str(b)]) == 1
    assert json.loads(capsys.readouterr().out)["notes"][0].startswith(f"B: {said}")


def test_logs_torn_alike_are_not_called_equal_runs(tmp_path, capsys):
    a, b = (flown(tmp_path / name, {"rover1": usual()}) for name in "ab")
    for run in (a, b):
        cut(run, 11)
    assert main(["diff", str(a), str(b)]) == 1
    assert capsys.readouterr().out.splitlines()[-1] == "equal as far as the logs go: 9 messages"


@pytest.mark.parametrize("back", [1, 2, 15])  # in the checksum, and in the payload
def test_a_flipped_bit_is_a_damaged_frame_and_not_a_value(tmp_path, capsys, back):
    a, b = (flown(tmp_path / name, {"rover1": usual()}) for name in "ab")
    log = b / "vehicles/rover1/rover1.tlog"
    data = bytearray(log.read_bytes())
    data[-back] ^= 4
    log.write_bytes(data)
    text = (
        "rover1 at 0.25 s: SET_POSITION_TARGET_LOCAL_NED (ground to vehicle): a frame that is"
        " damaged in B (its checksum is wrong)"
    )
    assert main(["diff", str(a), str(b)]) == 1
    assert text in capsys.readouterr().out.splitlines()
    assert main(["diff", "--json", str(a), str(b)]) == 1
    parting = json.loads(capsys.readouterr().out)["first"]["parting"]
    assert (parting["damaged_in"], parting["fields"]) == (["B"], [])


def test_a_message_of_another_dialect_is_compared_by_its_bytes(told):
    def foreign(value):
        return b"\xfd\x02\x00\x00\x00\x01\x01\xff\xff\x7f" + bytes((1, value)) + b"\x00\x00"

    a, b = Link(), Link()
    a.entries.append((1.0, foreign(1)))
    b.entries.append((1.0, foreign(2)))
    _, lines = told({"rover1": a}, {"rover1": b})
    text = "rover1 at 1.00 s: message 8388607.payload (vehicle to ground): '0101' | '0102'"
    assert lines[0] == text


def test_json_tells_the_same(tmp_path, capsys):
    link = usual(1).asked(1.0, target(1.0, float("nan")))
    a = flown(tmp_path / "a", {"rover1": link}, compiled="compiled")
    b = flown(tmp_path / "b", {"rover1": usual(1).asked(1.0, target(1.0))}, seed=2)
    assert main(["diff", "--json", str(a), str(b)]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["equal"] is False
    assert told["a"]["compiled"] == "compiled"
    assert told["settings"] == [{"key": "seed", "a": 1, "b": 2}]
    parting = told["first"]["parting"]
    assert (told["first"]["vehicle"], parting["time_s"]) == ("rover1", 1.0)
    assert parting["message"] == "SET_POSITION_TARGET_LOCAL_NED"
    assert parting["direction"] == "ground to vehicle"
    assert parting["fields"] == [{"name": "vx", "a": "nan", "b": pytest.approx(0.412)}]
    assert told["vehicles"] == [told["first"]]


moments = st.lists(st.tuples(st.integers(1, 6), st.sampled_from((0.1, 0.2, 0.3))), max_size=12)


@given(moments, moments)
def test_whatever_two_links_hold_they_part_behind_their_last_common_message(a, b):
    logs = []
    for said in (a, b):
        link = Link()
        for tick, roll in sorted(said):
            link.told(tick / 20, attitude(1.0, roll))
        logs.append([Entry(round(at * 1e6), frame) for at, frame in link.entries])
    there, back = (compare("rover1", 1, *pair, timed=True) for pair in (logs, logs[::-1]))
    pairs = zip(*logs, strict=False)
    assert there.equal == back.equal == len([*takewhile(lambda pair: pair[0] == pair[1], pairs)])
    assert (there.parting is None) == (logs[0] == logs[1])
    if there.parting and back.parting:
        assert (there.parting.a, there.parting.b) == (back.parting.b, back.parting.a)
        assert there.order == back.order


def refusal(capsys, a, b):
    assert main(["diff", str(a), str(b)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    return captured.err


def test_what_is_no_run_folder_is_refused(tmp_path, capsys):
    run = flown(tmp_path / "run", {"rover1": usual()})
    assert "no such folder" in refusal(capsys, run, tmp_path / "nowhere")
    assert "no robots" in refusal(capsys, run, _broken(tmp_path / "3", "scenario.yaml", "a: 1"))
    assert "not YAML" in refusal(capsys, run, _broken(tmp_path / "4", "scenario.yaml", "a: ["))
    torn = _broken(tmp_path / "5", "vehicles/rover1/rover1.tlog", "this is no telemetry log")
    assert "not a tlog" in refusal(capsys, run, torn)
    (torn / "vehicles/rover1/rover1.tlog").unlink()
    assert "rover1.tlog: No such file" in refusal(capsys, run, torn)


@pytest.mark.parametrize("text", ["[]", "{", "{}"])
def test_a_damaged_report_is_told_and_the_logs_are_compared(tmp_path, capsys, text):
    run = flown(tmp_path / "run", {"rover1": usual()})
    assert main(["diff", str(run), str(_broken(tmp_path / "b", "report.json", text))]) == 0
    assert "B: report.json: this is not a run's report" in capsys.readouterr().out


def _broken(folder: Path, name: str, text: str) -> Path:
    flown(folder, {"rover1": usual()})
    (folder / name).write_text(text)
    return folder
