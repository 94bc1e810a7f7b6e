"""Pictures of a run, each as PNG and SVG: what happened, how fast, how near, how exactly."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ...scenarios.schema import RobotSpec, Scenario
from .figure_conflicts import conflicts
from .figure_plan import plan
from .figure_ridges import errors, speeds
from .figure_separation import separation
from .figure_space import space
from .figure_style import RATE_HZ, save_both
from .judge import Verdict
from .truth import Track

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(
    folder: Path,
    scenario: Scenario,
    starts: Sequence[RobotSpec],
    tracks: Sequence[Track],
    verdict: Verdict,
) -> list[Path]:
    """Write every figure there is something for; return the PNGs. Beside each is its SVG."""
    tracks = sorted((t for t in tracks if len(t)), key=lambda t: t.system_id)
    if not tracks:
        return []
    figures: dict[str, Callable[[], Figure | None]] = {
        "plan": lambda: plan(scenario, starts, tracks, verdict)
    }
    since_ready = min(verdict.ended_at, *(t.time[-1] for t in tracks))
    since_ready -= verdict.ready_at or 0.0
    if since_ready > 2 / RATE_HZ and verdict.ready_at is not None:
        figures["space"] = lambda: space(scenario, starts, tracks, verdict)
        if any(pair.min_separation is not None for pair in verdict.pairs):
            figures["separation"] = lambda: separation(starts, tracks, verdict)
        figures["conflicts"] = lambda: conflicts(starts, tracks, verdict)
        figures["speeds"] = lambda: speeds(starts, tracks, verdict)
        figures["errors"] = lambda: errors(scenario, starts, tracks, verdict)
    folder.mkdir(parents=True, exist_ok=True)
    drawn = []
    for name, make in figures.items():
        if (figure := make()) is not None:
            drawn.append(save_both(folder / f"{name}.png", figure))
    return drawn
