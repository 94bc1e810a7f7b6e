"""Draw the paper's two traffic missions under every law: `python docs/laws_picture.py [FOLDER]`."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure
from missions import CROSSING, TRAFFIC, Flight, fly

from mavherd.gcs.report.figure_style import COLOURS, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PICTURES = Path(__file__).parent / "pictures"
SHOWN_S = {CROSSING: 27.0, TRAFFIC: 42.0}  # from when all were ready
LAWS = {"off": "off: tracking alone", "paper": "paper: eq. 22 and 23", "safe": "safe (default)"}


def draw(axes: "Axes", flight: Flight) -> None:
    """Draw the tracks until all have arrived, and where robots met."""
    end = flight.ready + SHOWN_S[flight.scenario.name]
    for track, colour in zip(flight.tracks, COLOURS, strict=False):
        part = (track.time >= flight.ready) & (track.time <= end)
        flies = track.kind == "quadcopter"
        east, north = track.position[part, 0], track.position[part, 1]
        axes.plot(east, north, color=colour, lw=1.4, ls=(0, (4, 2)) if flies else "-")
        axes.plot(east[:1], north[:1], "s" if not flies else "D", color=colour, ms=4)
    events = flight.report["collision_events"]
    axes.plot(
        [e["east_m"] for e in events],
        [e["north_m"] for e in events],
        "x",
        color="#b3261e",
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
        color="#b3261e" if count else "#00664b",
    )
    axes.set_aspect("equal")
    axes.grid(color="#e6e6e6", lw=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=7, length=2, color="#999999")
    for side in axes.spines.values():
        side.set_color("#cccccc")


def main(folder: Path = PICTURES) -> None:
    """Fly the six runs and write the picture."""
    figure = Figure(figsize=(10.5, 7.0), layout="constrained")
    panels = figure.subplots(len(SHOWN_S), len(LAWS), sharex="row", sharey="row")
    for row, mission in zip(panels, SHOWN_S, strict=True):
        for axes, (law, title) in zip(row, LAWS.items(), strict=True):
            draw(axes, fly(mission, law))
            if mission == CROSSING:
                axes.set_title(title, fontsize=11, loc="left")
        row[0].set_ylabel(f"{mission}\nnorth, m", fontsize=9)
    for axes in panels[-1]:
        axes.set_xlabel("east, m", fontsize=9)
    key = "rovers solid from squares, quadcopters dashed from diamonds, x: contact"
    figure.supxlabel(key, fontsize=9, color="#555555")
    folder.mkdir(parents=True, exist_ok=True)
    path = save(folder / "laws.png", figure)
    print(f"{path}: {path.stat().st_size // 1024} kB")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
