"""The pictures of README and docs: small, and made by what they say made them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("matplotlib")

DOCS = Path(__file__).parent.parent / "docs"


@pytest.fixture(scope="module")
def docs():
    """Let the scripts in docs/ be imported."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(DOCS))
        yield


@pytest.mark.parametrize(
    ("mission", "under_paper"), [("CROSSING", 1), ("TRAFFIC", 2)], ids=["figure 5", "figure 6"]
)
@pytest.mark.usefixtures("docs")
def test_figures_show_the_collisions_that_the_pages_tell(mission, under_paper):
    import missions
    import paper_figures

    settings = paper_figures.WAITING if mission == "CROSSING" else ()
    name = getattr(missions, mission)
    assert len(missions.fly(name, "paper", *settings).collisions) == under_paper
    assert missions.fly(name, "safe", *settings).collisions == []


@pytest.mark.usefixtures("docs")
def test_figure_6_ends_with_all_at_their_places_and_says_who_is_who():
    import missions
    import paper_figures

    figure = paper_figures.figure6()
    flight = missions.fly(missions.TRAFFIC, "safe")
    told = {text.get_text() for legend in figure.legends for text in legend.get_texts()}
    assert told >= {track.name for track in flight.tracks}
    rover3 = next(track for track in flight.tracks if track.name == "rover3")
    assert flight.way(rover3)[-1] == pytest.approx([0, 0, 0], abs=0.2)
    titles = [text.get_text() for text in figure.texts]
    assert titles == ["(a) Law paper: equations 22 and 23", "(a) Law safe: mavherd's default"]


def test_what_cannot_be_made_here_is_told(tmp_path):
    made = subprocess.run(
        [sys.executable, str(DOCS / "make_pictures.py"), "pages", "live"],
        env={**os.environ, "PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 1
    assert made.stderr.count("there is no Chromium here") == 2
    assert "python docs/make_pictures.py pages live" in made.stderr


@pytest.mark.usefixtures("docs")
def test_pictures_are_small():
    import make_pictures

    sizes = [path.stat().st_size for path in (DOCS / "pictures").iterdir()]
    assert sum(sizes) < make_pictures.MOST_BYTES
