"""Take the pictures of recorded dashboards: `python docs/recorded_pictures.py [FOLDER]`.

One is of a robot's own plots, one of a hundred robots. It needs the extra `view` and a graphics
driver (Debian: mesa-vulkan-drivers).
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from chromium import shrink
from missions import CROSSING

PICTURES = Path(__file__).parent / "pictures"
SIZE = "1400x800"
CROWD = """\
name: crowd
description: Two crowds of rovers meet, and two of quadcopters above them
duration: 90
team: {law: safe, rate_hz: 20}
robots:
  - {kind: rover, name: west, count: 25, spacing: 2.5, start: {east: -26, north: -5}, goto: {east: 14, north: -5}}
  - {kind: rover, name: east, count: 25, spacing: 2.5, start: {east: 14, north: -5, heading_deg: 180}, goto: {east: -26, north: -5}}
  - {kind: quadcopter, name: south, count: 25, spacing: 2.5, start: {east: -6, north: -26}, goto: {east: -6, north: 16, up: 6}}
  - {kind: quadcopter, name: north, count: 25, spacing: 2.5, start: {east: -6, north: 16}, goto: {east: -6, north: -26, up: 6}}
expect: {collisions: 0}
"""  # noqa: E501 a robot is a line


def main(folder: Path = PICTURES) -> None:
    """Write dashboard-robot.png and dashboard-crowd.png."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch)
        look(fly(CROSSING, out), folder / "dashboard-robot.png", "--time=15", "--select=quad2")
        crowd = out / "crowd.yaml"
        crowd.write_text(CROWD, encoding="utf-8")
        look(fly(str(crowd), out), folder / "dashboard-crowd.png", "--time=22")


def fly(scenario: str, out: Path) -> Path:
    """Run a scenario; return its folder."""
    ports = [x for name in ("gcs-udp", "api-udp", "tcp") for x in (f"--{name}", "0")]
    mavherd("run", scenario, *ports, f"--out={out}")
    return max((path for path in out.iterdir() if path.is_dir()), key=lambda p: p.stat().st_mtime)


def look(run: Path, path: Path, *options: str) -> None:
    """Write a picture of a run's recording."""
    whole = run / "picture.png"
    mavherd("view", str(run), f"--screenshot={whole}", f"--size={SIZE}", *options)
    shrink(whole.read_bytes(), path)
    print(f"{path}: {path.stat().st_size // 1024} kB")


def mavherd(*words: str) -> None:
    """Run a command without its words on the screen."""
    done = subprocess.run(
        [sys.executable, "-m", "mavherd", *words], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise SystemExit(done.stderr or f"mavherd {words[0]} ended with {done.returncode}")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
