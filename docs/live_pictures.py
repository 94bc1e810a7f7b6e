"""Take the pictures of the dashboard in a live run: `python docs/live_pictures.py [FOLDER]`.

One run is watched in Rerun's own window, without a display, and in Chromium at the same time.
It needs the extra `view`, Chromium and a graphics driver (Debian: chromium, mesa-vulkan-drivers).
"""

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from urllib.parse import unquote, urlsplit

from chromium import Chromium, find_browser, shrink

from mavherd.gcs.recording.viewers import Viewer

PICTURES = Path(__file__).parent / "pictures"
SIZE = 1400, 800
MOMENT_TICKS = 300  # of 50 ms, when the robots meet
SCENARIO = "crossing-targets"
LOOK_S, CALM_S, STILL_S = 2.0, 20.0, 400.0  # between looks; without change; at most
FULL_BYTES = 150_000  # a picture of less is of a page that still waits for data
WELCOME_S = 90.0  # for the page to be there: 43 MB to compile


def main(folder: Path = PICTURES) -> None:
    """Write dashboard.png and dashboard-web.png."""
    find_browser()
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        run = start(Path(scratch))
        try:
            url = page_of(run)
            source = unquote(urlsplit(url).query.removeprefix("url="))
            take(run, url, source, Path(scratch), folder)
        finally:
            run.terminate()
            run.wait()


def start(out: Path) -> "subprocess.Popen[str]":
    """Start a run that waits for us."""
    options = ["--web", "--paused"]
    ports = [x for name in ("gcs-udp", "api-udp", "tcp", "web-port") for x in (f"--{name}", "0")]
    return subprocess.Popen(
        [sys.executable, "-m", "mavherd", "run", SCENARIO, *options, *ports, f"--out={out}"],
        stderr=subprocess.PIPE,
        text=True,
    )


def page_of(run: "subprocess.Popen[str]") -> str:
    """Return the URL that the run tells."""
    assert run.stderr is not None
    for line in run.stderr:
        if found := re.search(r"http://\S+", line):
            return found[0]
    raise SystemExit(f"{SCENARIO} ended with {run.wait()} and told no page")


def take(run: "subprocess.Popen[str]", url: str, source: str, scratch: Path, folder: Path) -> None:
    """Open both viewers, let the run go on, and take both pictures at one moment."""
    from rerun.experimental import ViewerClient

    run_folder = next(scratch.glob(f"{SCENARIO}-*"))
    window = f"{SIZE[0]}x{SIZE[1]}"
    options = [f"--connect={source}", "--headless", "--window-size", window]
    log = scratch / "viewer.txt"
    viewer = Viewer("viewer", options, log, leash=True, environment={"RUST_LOG": "info"})
    with Chromium(*SIZE) as browser:
        try:
            browser.open(f"{url}&renderer=webgl&theme=dark")
            loaded = "!!document.querySelector('canvas.visible')"
            deadline = time.monotonic() + WELCOME_S
            while not browser.evaluate(loaded):
                browser.wait(0.5)
                if time.monotonic() > deadline:
                    raise SystemExit("the page did not load")
            found = re.search(r"127\.0\.0\.1:(\d+)\.", log.read_text())
            if not found:
                raise SystemExit(f"the viewer did not come up: {log.read_text()}")
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{found[1]}/proxy")
            browser.wait(8.0)  # its first words cover a corner
            clock(run_folder, "step", str(MOMENT_TICKS))
            shrink(still(browser), folder / "dashboard-web.png")
            shrink(client.take_screenshot(), folder / "dashboard.png")
        finally:
            viewer.end()
    hosts = sorted({urlsplit(asked).netloc for asked in browser.requests})
    print(f"{folder}: dashboard.png, dashboard-web.png; the page asked {', '.join(hosts)}")


def still(browser: Chromium) -> bytes:
    """Return the first picture that has not changed for a while."""
    picture, changed = browser.picture(), time.monotonic()
    deadline = changed + STILL_S
    while time.monotonic() < min(changed + CALM_S, deadline):
        browser.wait(LOOK_S)
        if (now := browser.picture()) != picture or len(now) < FULL_BYTES:
            picture, changed = now, time.monotonic()
    return picture


def clock(run: Path, *words: str) -> None:
    """Tell the run how time shall pass."""
    subprocess.run([sys.executable, "-m", "mavherd", "clock", str(run), *words], check=True)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
