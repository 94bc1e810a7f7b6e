"""Take the pictures of a report and of a comparison: `python docs/page_pictures.py [FOLDER]`.

Each shows a page twice, side by side: its beginning, and its figures as they are in the dark.
It needs the extra `view` and Chromium (Debian: chromium).
"""

import io
import subprocess
import sys
import tempfile
from pathlib import Path

from chromium import Chromium, find_browser, shrink
from missions import CROSSING

PICTURES = Path(__file__).parent / "pictures"
LAWS = "off", "paper", "safe"
SIZE = 760, 900  # of each half
DARK = "--blink-settings=preferredColorScheme=0"


def main(folder: Path = PICTURES) -> None:
    """Write report.png and compare.png."""
    find_browser()
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        runs = [fly(law, Path(scratch)) for law in LAWS]
        out = Path(scratch) / "comparison"
        mavherd("compare", *map(str, runs), f"--out={out}")
        picture(runs[-1] / "report.html", folder / "report.png")
        picture(out / "compare.html", folder / "compare.png")


def fly(law: str, out: Path) -> Path:
    """Fly the crossing under a law; return the run's folder."""
    options = [f"--set=team.law={law}", "--in-process", f"--out={out / law}"]
    mavherd("run", CROSSING, *options)
    return next((out / law).iterdir())


def mavherd(*words: str) -> None:
    """Run a command without its words on the screen; a run that failed its expectations is fine."""
    done = subprocess.run(
        [sys.executable, "-m", "mavherd", *words], capture_output=True, text=True, check=False
    )
    if done.returncode > 1:
        raise SystemExit(done.stderr)


def picture(page: Path, path: Path) -> None:
    """Write both halves; the page must ask nobody for anything and have no complaint."""
    from PIL import Image

    halves = [half(page, None), half(page, "figures", DARK)]
    width, height = SIZE
    both = Image.new("RGB", (2 * width, height))
    for k, png in enumerate(halves):
        both.paste(Image.open(io.BytesIO(png)), (k * width, 0))
    whole = io.BytesIO()
    both.save(whole, "png")
    shrink(whole.getvalue(), path)
    print(f"{path}: {path.stat().st_size // 1024} kB")


def half(page: Path, anchor: str | None, *options: str) -> bytes:
    """Return what a browser shows of a page from an anchor on."""
    with Chromium(*SIZE, options) as browser:
        browser.open(page.as_uri() + (f"#{anchor}" if anchor else ""))
        browser.wait(1.5)
        png = browser.picture()
        asked = [url for url in browser.requests if not url.startswith(page.as_uri())]
        if browser.complaints or asked:
            raise SystemExit(f"{page.name}: asked for {asked}, says {browser.complaints}")
        return png


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
