"""What the scenario tests share: text in, scenario or error text out."""

from collections.abc import Callable
from pathlib import Path
from textwrap import dedent

import pytest

from mavherd.scenarios.errors import ScenarioError
from mavherd.scenarios.loader import load_scenario
from mavherd.scenarios.schema import Scenario

Load = Callable[..., Scenario]
Refused = Callable[..., str]


@pytest.fixture
def load(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Load:
    """Load the scenario in a text, as if it were the file `team.yaml`."""
    monkeypatch.chdir(tmp_path)

    def from_text(text: str, *overrides: str, seed: int | None = None) -> Scenario:
        Path("team.yaml").write_text(dedent(text), encoding="utf-8")
        return load_scenario("team.yaml", overrides, seed)

    return from_text


@pytest.fixture
def refused(load: Load) -> Refused:
    """Return the text with which a scenario is refused: always one line."""

    def from_text(text: str, *overrides: str) -> str:
        with pytest.raises(ScenarioError) as caught:
            load(text, *overrides)
        assert caught.value.exit_code == 2
        assert "\n" not in str(caught.value)
        return str(caught.value)

    return from_text
