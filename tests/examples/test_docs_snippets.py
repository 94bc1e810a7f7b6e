"""docs/scripting.md: its snippets run as they stand, its tables tell the whole API."""

import re
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from textwrap import indent

import pytest

from mavherd.gcs.script import Fleet, Group, Vehicle

from .conftest import QUAD, Flight, run
from .conftest import Vehicle as Process

pytestmark = pytest.mark.timeout(600)
ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "scripting.md").read_text(encoding="utf-8")
SNIPPETS = re.findall(r"^```python\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
SCRIPTS = [snippet for snippet in SNIPPETS if "Fleet." in snippet]
PARTS = [snippet for snippet in SNIPPETS if "Fleet." not in snippet]
ADDRESSES = "udpin:127.0.0.1:14550", "udpin:0.0.0.0:14550"
# What speaks of a fleet that is open and a quad that is in the air finds both.
OPEN = """
from mavherd.gcs import Fleet
with Fleet.from_scenario("one-quad", set=["team.start_sigma_m=0"]) as fleet:
    quad = fleet["quad1"]
"""
UP = """
    if not quad.armed:
        quad.arm()
        quad.takeoff(up=3)
    quad.goto(0, 0, 3)
"""


def run_script(script: str, folder: Path) -> Flight:
    """Run a whole script, with a vehicle where it connects to one."""
    path = folder / "snippet.py"
    if "Fleet.connect" not in script:
        path.write_text(script)
        return run(folder, path)
    vehicle = Process(folder, 1, "ardupilot", QUAD)
    try:
        for address in ADDRESSES:
            script = script.replace(address, f"{address[:-5]}{vehicle.calls}")
        assert str(vehicle.calls) in script, "an address that the test does not know"
        path.write_text(script)
        return run(folder, path)
    finally:
        vehicle.end()


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Future[Flight]]]:
    """Run the scripts of the page at the same time."""
    folders = [tmp_path_factory.mktemp("snippet") for _ in SCRIPTS]
    with ThreadPoolExecutor() as pool:
        yield [pool.submit(run_script, *job) for job in zip(SCRIPTS, folders, strict=True)]


@pytest.mark.parametrize("number", range(len(SCRIPTS)))
def test_scripts_run(number, begun):
    flight = begun[number].result()
    assert flight.code == 0, f"{SCRIPTS[number]}\n{flight.said}"


def test_other_snippets_run_one_after_the_other(tmp_path):
    told = [f"    print('{n} of {len(PARTS)} done')\n" for n in range(1, len(PARTS) + 1)]
    parts = [UP + indent(part, "    ") + done for part, done in zip(PARTS, told, strict=True)]
    flight = run_script(OPEN + "".join(parts), tmp_path)
    assert flight.code == 0, flight.said
    assert f"{len(PARTS)} of {len(PARTS)} done" in flight.said


def test_the_readme_shows_the_first_of_them():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert SCRIPTS[0] in re.sub(r" +#.*", "", readme)


@pytest.mark.parametrize("kind", [Fleet, Vehicle, Group])
def test_the_page_tells_every_name(kind):
    table = TEXT.partition("## The API")[2]
    told = set(re.findall(r"\b[a-z_]+\b", table))
    public = {name for name in vars(kind) if not name.startswith("_")}
    assert public - told == set()
