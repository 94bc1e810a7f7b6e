"""A page as Chromium shows it, driven over DevTools through two pipes: no port, no library.

Time is the real one: virtual time races the compilation of what the page loads.
"""

import base64
import fcntl
import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

NAMES = "chromium", "chromium-browser", "google-chrome"
PATIENCE_S = 60.0  # for an answer
_HIGH = 10  # file descriptors from here on are neither 3 nor 4
_AS_3_AND_4 = """  # where a browser looks for its pipes; here they may be somebody else's
import os, sys
for theirs, ours in enumerate(map(int, sys.argv[1:3]), 3):
    os.dup2(ours, theirs)
    os.close(ours)
os.execv(sys.argv[3], sys.argv[3:])
"""


class Chromium:
    """One headless browser with one page; what it asks the network for is in `requests`."""

    def __init__(self, width: int, height: int, options: Sequence[str] = ()) -> None:
        binary = find_browser()
        self.requests: list[str] = []
        self.complaints: list[str] = []  # of the page, on its console
        self._profile = tempfile.TemporaryDirectory(prefix="mavherd-chromium-")
        theirs_in, self._out = os.pipe()
        self._in, theirs_out = os.pipe()
        ends = [fcntl.fcntl(fd, fcntl.F_DUPFD, _HIGH) for fd in (theirs_in, theirs_out)]
        command = [
            *(binary, "--headless=new", "--remote-debugging-pipe", "--no-sandbox"),
            *("--no-first-run", f"--user-data-dir={self._profile.name}", "--hide-scrollbars"),
            *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
            *("--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
            *(f"--window-size={width},{height}", *options, "about:blank"),
        ]
        self._process = subprocess.Popen(
            [sys.executable, "-c", _AS_3_AND_4, *map(str, ends), *command],
            stderr=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stdin=subprocess.DEVNULL,
            pass_fds=ends,
        )
        for fd in (theirs_in, theirs_out, *ends):
            os.close(fd)
        self._buffer = b""
        self._number = 0
        self._session = ""
        pages = self._ask("Target.getTargets")["targetInfos"]
        target = next(page["targetId"] for page in pages if page["type"] == "page")
        attached = self._ask("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Network", "Runtime", "Log"):
            self._ask(f"{domain}.enable")
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self._ask("Emulation.setDeviceMetricsOverride", **size)

    def open(self, url: str) -> None:
        """Go to a page."""
        self._ask("Page.navigate", url=url)

    def wait(self, seconds: float) -> None:
        """Let the page go on."""
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0:
            self._hear(left)

    def evaluate(self, expression: str) -> Any:
        """Return the value of a JavaScript expression on the page."""
        answer = self._ask("Runtime.evaluate", expression=expression, returnByValue=True)
        return answer["result"].get("value")

    def picture(self) -> bytes:
        """Return a PNG of what is seen."""
        return base64.b64decode(self._ask("Page.captureScreenshot", format="png")["data"])

    def close(self) -> None:
        """End the browser."""
        os.close(self._out)  # it ends itself when nobody can ask any more
        try:
            self._process.wait(5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._in)
        self._profile.cleanup()

    def __enter__(self) -> "Chromium":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _ask(self, method: str, **params: Any) -> dict[str, Any]:
        self._number += 1
        request = {"id": self._number, "method": method, "params": params}
        if self._session:
            request["sessionId"] = self._session
        os.write(self._out, json.dumps(request).encode() + b"\0")
        deadline = time.monotonic() + PATIENCE_S
        while (left := deadline - time.monotonic()) > 0:
            for message in self._hear(left):
                if message.get("id") != self._number:
                    continue
                if "error" in message:
                    raise SystemExit(f"Chromium: {method}: {message['error']['message']}")
                return dict(message["result"])
        raise SystemExit(f"Chromium: no answer to {method}")

    def _hear(self, timeout: float) -> list[dict[str, Any]]:
        """Return what it says within `timeout` seconds, and note what is worth it."""
        if not select.select([self._in], [], [], timeout)[0]:
            return []
        data = os.read(self._in, 1 << 20)
        if not data:
            raise SystemExit(f"Chromium ended with {self._process.wait()}")
        *texts, self._buffer = (self._buffer + data).split(b"\0")
        messages = [json.loads(text) for text in texts]
        for message in messages:
            self._note(message.get("method", ""), message.get("params", {}))
        return messages

    def _note(self, method: str, params: dict[str, Any]) -> None:
        match method:
            case "Network.requestWillBeSent":
                self.requests.append(params["request"]["url"])
            case "Runtime.consoleAPICalled" if params["type"] == "error":
                words = [str(a.get("value", a.get("description"))) for a in params["args"]]
                self.complaints.append(" ".join(words))
            case "Log.entryAdded" if params["entry"]["level"] == "error":
                self.complaints.append(params["entry"]["text"])
            case "Runtime.exceptionThrown":
                self.complaints.append(params["exceptionDetails"]["text"])


def find_browser() -> str:
    """Return where Chromium is."""
    binary = next(filter(None, map(shutil.which, NAMES)), None)
    if binary is None:
        raise SystemExit(f"there is no Chromium here (looked for {', '.join(NAMES)})")
    return binary


def shrink(png: bytes, path: Path) -> None:
    """Write a picture of a few plain colours, as user interfaces are, with a palette.

    (Colours that cover much, moved to their means: median cut shifts those of small things.)
    """
    import io

    from PIL import Image

    with Image.open(io.BytesIO(png)) as image:
        small = image.convert("RGB").quantize(
            256, method=Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE
        )
        small.save(path, optimize=True)
