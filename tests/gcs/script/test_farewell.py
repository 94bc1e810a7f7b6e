"""However a script ends, its vehicles come to rest, or it is said which ones do not."""

from types import SimpleNamespace

import pytest

from mavherd.gcs.run.open_run import RunOptions
from mavherd.gcs.script import FleetError, LinkLost
from mavherd.gcs.script.stage import Stage
from mavherd.gcs.station import StationError


class DeskPace:
    """Time on a desk; `failed` and `broken` as the test wants it."""

    def __init__(self, desk):
        self.desk = desk
        self.lock = desk.lock
        self.failed = self.broken = False
        self.steps = 0
        self.wrong = {}  # what to raise, and in which step

    @property
    def now(self):
        return self.desk.now

    def step(self, *, anyhow=False):
        assert anyhow or not self.failed
        self.steps += 1
        assert self.steps < 4000, "it does not end"
        if error := self.wrong.get(self.steps):
            raise error
        self.desk.step()

    def close(self):
        self.closed = True


@pytest.fixture
def flown(desk_of):
    """Return a quadcopter 3 m up, its desk, and the stage that is to bring it down."""
    fleet, desk = desk_of("quad1")
    stage = Stage(desk.core.scenario, RunOptions(), ["quad1"])
    stage._pace = DeskPace(desk)
    stage._ground = SimpleNamespace(core=desk.core)
    return fleet["quad1"], desk, stage


def up(quad):
    quad.arm()
    quad.takeoff(up=3)
    return quad


def abroad(desk, monkeypatch):
    """Have the quadcopter pass for an external one; only its spec says so."""
    spec = desk.core.members["quad1"].spec
    monkeypatch.setattr(type(spec), "external", property(lambda self: True))


def test_it_lands(flown):
    quad, _, stage = flown
    up(quad)
    stage.close("land", None)
    assert not quad.armed
    assert stage._pace.closed


def test_an_arming_under_way_is_taken_back(flown):
    quad, desk, stage = flown
    quad.begin_arm()
    while not any(getattr(m, "command", 0) == 400 for _, m in desk.sent["quad1"]):
        desk.step()
    assert not quad.armed  # as far as is known
    stage.close("land", None)
    for _ in range(40):
        desk.step()
    assert not quad.armed


def test_what_is_wrong_with_a_vehicle_does_not_keep_it_in_the_air(flown):
    quad, desk, stage = flown
    up(quad)
    member = desk.core.members["quad1"]
    watch = member.watch

    def complain(now):
        watch(now)
        raise StationError("quad1: its origin is 12 km away")

    member.watch = complain
    stage.close("land", None)
    assert not quad.armed


def test_one_that_does_not_come_to_rest_is_told_of(flown):
    quad, desk, stage = flown
    up(quad)
    desk.core.members["quad1"].clearance = SimpleNamespace(given=False, update=lambda *a, **k: None)
    with pytest.raises(LinkLost, match="quad1: does not come to rest, it was armed"):
        stage.close("land", None)
    assert stage._pace.closed


def test_a_failed_process_does_not_keep_external_vehicles_in_the_air(flown, monkeypatch):
    quad, desk, stage = flown
    up(quad)
    abroad(desk, monkeypatch)
    stage._pace.failed = True
    stage.close("land", FleetError("quad2 was killed"))
    assert not quad.armed


def test_where_time_cannot_go_on_the_error_tells_of_them(flown, monkeypatch):
    quad, desk, stage = flown
    up(quad)
    abroad(desk, monkeypatch)
    stage._pace.failed = stage._pace.broken = True
    error = RuntimeError("the pump")
    stage.close("land", error)
    assert "nobody steers quad1 any more, may be flying, armed" in " ".join(error.__notes__)


@pytest.mark.parametrize("wrong", [KeyboardInterrupt(), ValueError("a mistake"), SystemExit(1)])
def test_whatever_ends_the_landing_the_rest_is_ended_and_they_are_told_of(
    flown, monkeypatch, wrong
):
    quad, desk, stage = flown
    up(quad)
    abroad(desk, monkeypatch)
    stage._pace.wrong[5] = wrong
    with pytest.raises(type(wrong)) as caught:
        stage.close("land", None)
    assert stage._pace.closed
    assert "nobody steers quad1 any more" in caught.value.__notes__[0]


def test_a_fleet_that_was_closed_is_not_opened(flown):
    _, _, stage = flown
    stage.close("land", None)
    with pytest.raises(FleetError, match="opened once"):
        stage.open()
