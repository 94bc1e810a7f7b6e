"""A mission goes on from item to item, with jumps, and always comes to an end."""

from hypothesis import given
from hypothesis import strategies as st

from mavherd.vehicles.missions.items import Item
from mavherd.vehicles.missions.progress import Advance, Progress

NAV, DO, DELAY = Item(16), Item(178), Item(112)


def jump(seq, times):
    return Item(177, param1=seq, param2=times)


def walk(items, first_seq=1, most=50):
    """Return the NAV items in the order in which they are flown."""
    progress, out = Progress(first_seq), []
    while len(out) < most and (index := progress.advance(items).nav) is not None:
        out.append(index)
    return out


def test_do_items_belong_to_the_leg_that_they_stand_before():
    progress = Progress(1)
    items = [NAV, DO, DELAY, DO, NAV, DO]
    assert progress.advance(items) == Advance((), 0)
    assert progress.advance(items) == Advance((1, 2, 3), 4)
    assert progress.advance(items) == Advance((5,), None)
    assert progress.current == 4


def test_a_jump_is_taken_as_often_as_it_says():
    assert walk([NAV, NAV, jump(1, 2), NAV]) == [0, 1, 0, 1, 0, 1, 3]
    assert walk([NAV, jump(1, 0), NAV]) == [0, 2]
    assert walk([NAV, jump(1, -1), NAV], most=7) == [0] * 7


def test_jumps_count_as_the_ground_counts():
    assert walk([NAV, NAV, jump(1, 1)], first_seq=0) == [0, 1, 1]


def test_jumps_within_jumps_count_each_for_itself():
    assert walk([NAV, jump(1, 1), NAV, jump(1, 1)]) == [0, 0, 2, 0, 2]


def test_a_jump_to_nowhere_is_passed_over():
    for seq in (0, 9, -5, 65535, 1e30, -1e30):
        assert walk([NAV, jump(seq, 3), NAV]) == [0, 2]


def test_jumps_that_lead_only_to_jumps_come_to_an_end():
    assert walk([jump(2, -1), jump(1, -1), NAV]) == []
    assert walk([jump(1, -1)]) == []


def test_do_items_in_a_ring_are_not_gathered_for_ever():
    (others, nav) = Progress(1).advance([DO, jump(1, -1)])
    assert nav is None
    assert len(others) < 1000


@given(
    st.lists(
        st.one_of(
            st.sampled_from([NAV, DO, DELAY]),
            st.builds(jump, st.integers(-1, 12), st.integers(-2, 3)),
        ),
        max_size=10,
    ),
    st.sampled_from([0, 1]),
)
def test_every_mission_advances_within_bounds(items, first_seq):
    progress = Progress(first_seq)
    for _ in range(40):
        others, nav = progress.advance(items)
        assert all(0 <= i < len(items) for i in others)
        assert nav is None or items[nav] == NAV
        if nav is None:
            break


def test_another_item_can_be_wanted_and_counts_as_current():
    progress, items = Progress(1), [NAV, DO, NAV, NAV]
    progress.advance(items)
    progress.go_to(1)
    assert progress.shown == 1
    assert progress.advance(items) == Advance((1,), 2)
    assert progress.shown == 2


def test_a_shorter_list_ends_the_mission():
    progress = Progress(1)
    for _ in range(3):
        progress.advance([NAV] * 5)
    assert progress.advance([NAV] * 2) == Advance((), None)


def test_starting_again_forgets_the_jumps_and_the_end():
    progress, items = Progress(1), [NAV, jump(1, 1)]
    while progress.advance(items).nav is not None:
        pass
    progress.complete = True
    progress.begin_again()
    assert not progress.complete
    assert progress.current is None
    assert [progress.advance(items).nav for _ in range(3)] == [0, 0, None]
