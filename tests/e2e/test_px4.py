"""The paper's missions pass with our own vehicles speaking PX4, and repeat to the byte."""

import pytest


@pytest.mark.parametrize("mission", ["crossing-targets", "circle-traffic", "tracking"])
def test_a_mission_passes_with_every_vehicle_speaking_px4(sandbox, mission):
    done = sandbox.run("run", mission, "--autopilot", "px4", "--no-record", "--json", timeout=110)
    assert done.code == 0, done.err
    assert done.report["passed"]
    assert done.report["collisions"] == 0


def test_quadcopters_alone_may_speak_it_and_the_run_repeats(make_sandbox):
    changes = [f"robots.quad{i}.autopilot=px4" for i in (1, 2, 3)]
    options = [word for change in changes for word in ("--set", change)]
    runs = [make_sandbox(f"twin{i}") for i in (1, 2)]
    started = [each.start("run", "crossing-targets", "--no-record", *options) for each in runs]
    first, second = (
        each.finish(process, timeout=110) for each, process in zip(runs, started, strict=True)
    )
    assert first.code == second.code == 0, first.err
    assert first.report["digest"] == second.report["digest"] is not None
