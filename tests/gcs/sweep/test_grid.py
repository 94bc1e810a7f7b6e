"""What `--set KEY=V1,V2` and `--seeds` are read as, and what is refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavherd.gcs.sweep.grid import MAX_RUNS, Axis, read_seeds, read_sets, seeds_text
from mavherd.transport.errors import MavherdError


def refusal(read, argument):
    with pytest.raises(MavherdError) as error:
        read(argument)
    return str(error.value)


def test_several_values_make_an_axis_and_one_is_fixed_for_all_runs():
    fixed, grid = read_sets(["team.law=paper, safe", "duration=20", "team.rate_hz=10,20"])
    assert fixed == ("duration=20",)
    assert grid == (Axis("team.law", ("paper", "safe")), Axis("team.rate_hz", ("10", "20")))


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("[-20, 20],[-10, 10]", ("[-20, 20]", "[-10, 10]")),
        ("{east: 4, up: 3},{east: 5, up: 3}", ("{east: 4, up: 3}", "{east: 5, up: 3}")),
        ("'a, b',\"c, d\"", ("'a, b'", '"c, d"')),
        ("it's,that's", ("it's", "that's")),  # YAML: a quote within a word is a letter
        ("'it''s, so',b", ("'it''s, so'", "b")),
        (r'"a\", b",c', (r'"a\", b"', "c")),
        ("[[1, 2], [3]],[]", ("[[1, 2], [3]]", "[]")),
        ("{a: 'x}, y'},b", ("{a: 'x}, y'}", "b")),
        ("a]b,c", ("a]b", "c")),
        ("'',null", ("''", "null")),
        ("tcp:[::1]:5760,x", ("tcp:[::1]:5760", "x")),
    ],
)
def test_a_comma_within_brackets_or_quotes_belongs_to_the_value(text, values):
    assert read_sets([f"key={text}"])[1] == (Axis("key", values),)


def test_one_value_with_commas_inside_is_not_varied():
    text = "fence={east: [-20, 20], north: [-20, 20], up: 10}"
    assert read_sets([text]) == ((text,), ())


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (["team.law"], "--set team.law: not of the form KEY=V1,V2"),
        (["=a,b"], "not of the form"),
        (["team.law=paper,"], "a value is empty"),
        (["team.law=,paper"], "a value is empty"),
        (["team.law=safe,paper,safe"], "safe is there twice"),
        (["team.law=safe", "team.law=paper"], "team.law is set twice (give all its values in one"),
        (["seed=1,2"], "(--seeds 0:200)"),
        (["fence.east=[1, 2"], "a bracket is not closed"),
        (["name='a,b"], "a ' is not closed"),
    ],
)
def test_sets_that_say_nothing_clear_are_refused(texts, said):
    assert said in refusal(read_sets, texts)


@pytest.mark.parametrize(
    ("text", "seeds"),
    [
        ("0:4", (0, 1, 2, 3)),
        ("0,5,9", (0, 5, 9)),
        ("0:3,7, 10:12", (0, 1, 2, 7, 10, 11)),
        ("9223372036854775807", (2**63 - 1,)),
    ],
)
def test_seeds_are_half_open_ranges_and_single_numbers(text, seeds):
    assert read_seeds(text) == seeds


@given(st.lists(st.integers(0, 40), min_size=1, unique=True))
def test_the_text_of_seeds_reads_as_the_same_seeds(seeds):
    assert read_seeds(seeds_text(seeds)) == tuple(seeds)


def test_the_text_of_many_seeds_is_short():
    assert seeds_text(range(200)) == "0:200"
    assert seeds_text((*range(10), 500, 501)) == "0:10,500,501"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "'' is no seed"),
        ("x", "'x' is no seed (as in 0:200, or 0,5,9)"),
        ("1.5", "is no seed"),
        ("-1", "'-1' is no seed"),
        ("0:10:2", "is no seed"),
        ("٣", "is no seed"),  # a digit, but not an ASCII one
        ("5:", "has no end"),
        (":5", "is no seed"),
        ("5:5", "5:5 holds no seed"),
        ("9:3", "holds no seed"),
        ("0:4,2", "2 is there twice"),
        ("9223372036854775808", "a seed is at most 9223372036854775807"),
        (f"0:{MAX_RUNS + 1}", "at most 1,000,000 runs"),
        ("0:9223372036854775807", "at most 1,000,000 runs"),
    ],
)
def test_seeds_that_cannot_be_are_refused(text, said):
    assert said in refusal(read_seeds, text)
