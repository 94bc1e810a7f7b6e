"""What the documentation says is so: made pages are up to date, options and links exist."""

import argparse
import importlib
import re
from pathlib import Path

import pytest

from mavherd.gcs.commands.vehicle import add_options

ROOT = Path(__file__).parent.parent
PAGES = [*sorted((ROOT / "docs").glob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]


def options() -> set[str]:
    parser = argparse.ArgumentParser()
    add_options(parser)
    return {word for action in parser._actions for word in action.option_strings}


@pytest.mark.parametrize(
    ("module", "name"), [("make_mavlink", "mavlink.md"), ("make_parameters", "parameters.md")]
)
def test_made_pages_are_as_the_code_says(module, name, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    made = importlib.import_module(module).page()
    assert (ROOT / "docs" / name).read_text(encoding="utf-8") == made, "run `make docs`"


def test_every_option_of_a_vehicle_is_told_and_no_other():
    text = (ROOT / "docs" / "vehicles.md").read_text(encoding="utf-8")
    usage = re.search(r"^## Options$(.*?)^## ", text, re.MULTILINE | re.DOTALL)
    assert usage
    told = set(re.findall(r"`(--?[a-zA-Z]+)", usage[1]))
    assert told == options() - {"-h", "--help"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_use_options_that_exist(page):
    for line in re.findall(r"^ *(?:- run: )?mavherd vehicle .*$", page.read_text(), re.MULTILINE):
        used = set(re.findall(r"(?<=\s)--?[a-zA-Z]+", line.partition("#")[0]))
        assert used <= options(), line


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), f"{page.name} links to {target}"
