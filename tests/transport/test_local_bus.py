"""The bus of one process: keys and mailboxes as on Zenoh, without a network."""

import pytest

from mavherd.transport.local_bus import LocalBus, matches


@pytest.mark.parametrize(
    ("expression", "key", "fits"),
    [
        ("team", "team", True),
        ("team", "teams", False),
        ("vehicle/*/state", "vehicle/quad1/state", True),
        ("vehicle/*/state", "vehicle/quad1/target", False),
        ("vehicle/*/state", "vehicle/a/b/state", False),
        ("vehicle/*", "vehicle", False),
    ],
)
def test_a_star_is_one_part_of_a_key(expression, key, fits):
    assert matches(expression, key) is fits


@pytest.mark.parametrize("subscribed_first", [True, False])
def test_the_newest_of_each_key_is_kept(subscribed_first):
    bus = LocalBus()
    box = bus.latest("vehicle/*/state") if subscribed_first else None
    one, two = (bus.publisher(f"vehicle/{name}/state") for name in ("one", "two"))
    box = box or bus.latest("vehicle/*/state")
    for text in (b"old", b"new"):
        one.put(text)
    two.put(b"other")
    assert box.latest == {"vehicle/one/state": b"new", "vehicle/two/state": b"other"}
    assert box.received == 3
    assert box.arrived.is_set()


def test_a_publisher_knows_whether_anybody_listens():
    bus = LocalBus()
    team = bus.publisher("team")
    assert not team.wanted
    bus.latest("team")
    assert team.wanted
    assert bus.publisher("team").wanted
    assert not bus.publisher("clock").wanted
