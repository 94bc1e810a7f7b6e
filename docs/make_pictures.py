"""Draw docs/pictures/laws.png: the paper's two traffic missions under every law, seed 1."""

import tempfile
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mavherd.gcs.report.truth import read_truth
from mavherd.gcs.run.launcher import Run, RunOptions
from mavherd.gcs.run.ports import PortPlan
from mavherd.scenarios.loader import load_scenario

OUT = Path(__file__).parent / "pictures" / "laws.png"
MISSIONS = ("crossing-targets", "circle-traffic")
LAWS = {"off": "off: tracking alone", "paper": "paper: eq. 22 and 23", "safe": "safe (default)"}
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#56b4e9", "#b8860b", "#cc79a7")
NO_PORTS = PortPlan(gcs_udp=0, api_udp=0, tcp=0)


def fly(mission: str, law: str, folder: Path) -> tuple[list[Any], dict[str, Any]]:
    """Run once; return the tracks of the way out and the report."""
    scenario = load_scenario(mission, [f"team.law={law}"], seed=1)
    options = RunOptions(out=folder, record=False, figures=False, ports=NO_PORTS)
    outcome = Run(scenario, options).execute()
    folders = sorted((outcome.folder / "vehicles").iterdir())
    return [read_truth(vehicle / "truth.bin") for vehicle in folders], outcome.report


def draw(axes: Any, tracks: list[Any], report: dict[str, Any]) -> None:
    """Draw the tracks until all have arrived, and where robots met."""
    ready = report["ready_at_s"]
    end = ready + 27 if report["scenario"] == "crossing-targets" else ready + 42
    for track, colour in zip(tracks, COLOURS, strict=True):
        part = (track.time >= ready) & (track.time <= end)
        flies = track.kind == "quadcopter"
        east, north = track.position[part, 0], track.position[part, 1]
        axes.plot(east, north, color=colour, lw=1.4, ls=(0, (4, 2)) if flies else "-")
        axes.plot(east[:1], north[:1], "s" if not flies else "D", color=colour, ms=4)
    events = report["collision_events"]
    axes.plot(
        [e["east_m"] for e in events],
        [e["north_m"] for e in events],
        "x",
        color="#cc0000",
        ms=9,
        mew=2.2,
        zorder=9,
    )
    count = len(events)
    text = "no collision" if not count else f"{count} collision{'s' * (count > 1)}"
    axes.text(
        0.97,
        0.04,
        text,
        transform=axes.transAxes,
        ha="right",
        fontsize=10,
        weight="bold",
        color="#cc0000" if count else "#00663f",
    )
    axes.set_aspect("equal")
    axes.grid(color="#e6e6e6", lw=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=7, length=2, color="#999999")
    for side in axes.spines.values():
        side.set_color("#cccccc")


def main() -> None:
    """Fly the six runs and write the picture."""
    figure = Figure(figsize=(10.5, 7.2), dpi=95, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(MISSIONS), len(LAWS), sharex="row", sharey="row")
    for row, mission in zip(panels, MISSIONS, strict=True):
        for axes, (law, title) in zip(row, LAWS.items(), strict=True):
            with tempfile.TemporaryDirectory() as folder:
                draw(axes, *fly(mission, law, Path(folder)))
            if mission == MISSIONS[0]:
                axes.set_title(title, fontsize=11, loc="left")
        row[0].set_ylabel(f"{mission}\nnorth, m", fontsize=9)
    for axes in panels[-1]:
        axes.set_xlabel("east, m", fontsize=9)
    figure.text(
        0.5, -0.02, "rovers solid from squares, quadcopters dashed from diamonds, x: contact",
        ha="center", fontsize=9, color="#555555",
    )  # fmt: skip
    OUT.parent.mkdir(exist_ok=True)
    figure.savefig(OUT, bbox_inches="tight")
    print(OUT)


if __name__ == "__main__":
    main()
