"""STATUSTEXT: whole, in order, and not too often."""

import pytest

from mavherd.vehicles.flight.speaker import Speaker


def said(text):
    speaker = Speaker()
    speaker.say(text, 6, "", now=1.0)
    return speaker.take()


@pytest.mark.parametrize("length", [0, 1, 49, 50])
def test_a_short_text_is_one_message_without_an_id(length):
    (message,) = said("x" * length)
    assert (message.text, message.id, message.chunk_seq) == ("x" * length, 0, 0)


@pytest.mark.parametrize("length", [51, 99, 100, 101, 150])
def test_a_long_text_comes_in_chunks_of_which_the_last_has_room_left(length):
    chunks = said("x" * length)
    assert "".join(m.text for m in chunks) == "x" * length
    assert [m.chunk_seq for m in chunks] == list(range(len(chunks)))
    assert {m.id for m in chunks} == {1}
    assert [len(m.text) for m in chunks[:-1]] == [50] * (len(chunks) - 1)
    assert len(chunks[-1].text) < 50, "else stations wait for more"


def test_equal_topics_are_said_once_a_second():
    speaker = Speaker()
    for tenth in range(25):
        speaker.say(f"now {tenth}", 6, "time", now=tenth / 10)
    assert [m.text for m in speaker.take()] == ["now 0", "now 10", "now 20"]


def test_a_refusal_is_repeated_with_its_reason_but_no_flood():
    speaker = Speaker()
    for tick in range(100):
        speaker.say("Arm: no", 6, "", now=tick / 100)
    assert 9 <= len(speaker.take()) <= 10
