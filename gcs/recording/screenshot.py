"""Pictures of recordings, taken by a viewer that needs no display."""

import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from .stream import TIMELINE
from .viewers import Viewer, ViewerError, proxy_url

if TYPE_CHECKING:
    from rerun.experimental import ViewerClient

_UP_S = 30.0  # for a viewer to come up, and to load what it shall show
_STILL_S = 60.0  # for a picture that changes no more
_LOOK_S = 0.5
_QUIET = {"RUST_LOG": "error"}  # else warnings hide a corner of the picture


class Size(NamedTuple):
    """Of a picture, in pixels."""

    width: int
    height: int


def take(
    sources: Sequence[Path | str], picture: Path, size: Size, at: float | None, port: int, log: Path
) -> None:
    """Write a PNG of `sources` at fleet time `at`, which is the end unless given.

    The viewer is reached at `port`, one that is free. Raises ViewerError when it does not come up.
    """
    window = f"{size.width}x{size.height}"
    options = ["--headless", "--window-size", window, "--hide-welcome-screen", "--port", port]
    viewer = Viewer("viewer", [*options, *sources], log, leash=True, environment=_QUIET)
    try:
        client = _connect(viewer, port)
        _wait_loaded(client, viewer)
        end = max(_ends(client), default=0.0)
        client.set_time(TIMELINE, duration=end if at is None else at, play_state="paused")
        picture.write_bytes(_still(client))
    except RuntimeError as error:  # the viewer's own
        raise ViewerError(viewer.death() or f"the viewer failed: {error}") from None
    finally:
        viewer.end()


def _connect(viewer: Viewer, port: int) -> "ViewerClient":
    from rerun.experimental import ViewerClient

    deadline = time.monotonic() + _UP_S
    while True:
        with suppress(RuntimeError, ConnectionError):
            client = ViewerClient.connect(proxy_url(port))
            client.get_state()
            return client
        if death := viewer.death():
            raise ViewerError(death)
        if time.monotonic() > deadline:
            raise ViewerError(f"the viewer did not come up in {_UP_S:.0f} s")
        time.sleep(_LOOK_S)


def _wait_loaded(client: "ViewerClient", viewer: Viewer) -> None:
    deadline = time.monotonic() + _UP_S
    while True:
        state = client.get_state()
        if state.recordings and state.views and not state.loading:
            return
        if death := viewer.death():
            raise ViewerError(death)
        if time.monotonic() > deadline:
            raise ViewerError(f"the viewer did not show anything in {_UP_S:.0f} s")
        time.sleep(_LOOK_S)


def _ends(client: "ViewerClient") -> list[float]:
    """Return when each recording ends, in seconds."""
    lines = [line for r in client.get_state().recordings for line in r.timelines]
    return [line.end * 1e-9 for line in lines if line.name == TIMELINE and line.end]


def _still(client: "ViewerClient") -> bytes:
    """Return the first picture that is like the one before."""
    deadline = time.monotonic() + _STILL_S
    picture, last = client.take_screenshot(), b""
    while picture != last and time.monotonic() < deadline:
        time.sleep(_LOOK_S)
        picture, last = client.take_screenshot(), picture
    return bytes(picture)
