"""`mavherd clock`: where it finds a run's clock, and what it says where there is none."""

import json
import socket

import pytest

from mavherd.gcs.cli import main
from mavherd.gcs.commands import clock
from mavherd.gcs.run.in_process import simulate
from mavherd.scenarios.loader import load_scenario
from mavherd.transport.bus import Bus
from mavherd.transport.questions import Answer


@pytest.fixture
def said(capsys):
    """Return the one line with which an order is refused."""

    def ask(*words):
        assert main(["clock", *map(str, words)]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        return line

    return ask


def test_a_run_in_one_process_has_no_clock_to_ask(said, tmp_path):
    scenario = load_scenario("one-rover", ["duration=1"])
    folder = simulate(scenario, keep=tmp_path).folder
    assert said(folder, "pause").startswith(f"mavherd: {folder}: no clock to ask (the run is in")
    assert "the folder of a run?" in said(tmp_path, "pause")


@pytest.mark.parametrize("words", [("step", "400"), ("STEP", "400"), (" Step 400",)])
def test_however_it_is_written_steps_are_waited_for(words, monkeypatch, capsys):
    asked = []

    class Client:
        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        def ask(self, key, order, patience):
            asked.append((order, patience))
            return Answer(True, '{"t": 20.0, "paused": true, "speed": "max"}')

    monkeypatch.setattr(Bus, "client", lambda endpoint, run_id: Client())
    with socket.create_server(("127.0.0.1", 0)) as router:
        endpoint = f"tcp/127.0.0.1:{router.getsockname()[1]}"
        assert main(["clock", endpoint, *words]) == 0
    assert asked == [("step 400", clock._STEP_PATIENCE_S)]
    assert capsys.readouterr().out == "20.00 s, paused, max speed\n"


def test_a_run_that_has_ended_is_told_as_that_without_asking_zenoh(
    said, tmp_path, monkeypatch, endpoint
):
    monkeypatch.setattr(Bus, "client", lambda *_: pytest.fail("Zenoh tries for seconds"))
    (tmp_path / "ports.json").write_text(json.dumps({"zenoh": endpoint}))
    for where in (tmp_path, endpoint):
        assert said(where, "pause") == f"mavherd: {where}: its clock is gone: the run has ended"
