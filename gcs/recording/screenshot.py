"""Pictures of recordings, taken by a viewer that needs no display."""

import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from .contents import ids_of
from .served import prepare, proxy_url
from .stream import TIMELINE
from .viewers import Viewer, ViewerError, Viewing

if TYPE_CHECKING:
    from rerun.experimental import Recording, ViewerClient

_UP_S = 30.0  # for a viewer to come up, and to load what it shall show
_STILL_S = 60.0  # for a picture that changes no more
_LOOK_S = 0.5
_QUIET = {"RUST_LOG": "error"}  # else warnings hide a corner of the picture


class Size(NamedTuple):
    """Of a picture, in pixels."""

    width: int
    height: int


def take(sources: Sequence[Path], picture: Path, size: Size, at: float | None, log: Path) -> None:
    """Write a PNG of `sources` at fleet time `at`, which is the end unless given.

    Raises ViewerError when the viewer does not come up, or shows something else.
    """
    wanted = {name for file in sources if file.suffix == ".rrd" for name in ids_of(file)}
    ports = prepare(Viewing(view_port=0))
    window = f"{size.width}x{size.height}", "--hide-welcome-screen", "--port", ports.data
    options = ["--headless", "--window-size", *window, *sources]
    viewer = Viewer("viewer", options, log, leash=True, environment=_QUIET)
    try:
        client = _connect(viewer, ports.data)
        _wait_loaded(client, viewer, wanted)
        end = max(_ends(client), default=0.0)
        client.set_time(TIMELINE, duration=end if at is None else at, play_state="paused")
        part = picture.with_name(f"{picture.name}.part")
        part.write_bytes(_still(client))
        part.replace(picture)
    except RuntimeError as error:  # the viewer's own
        raise ViewerError(viewer.death() or f"the viewer failed: {error}") from None
    finally:
        viewer.end()
        ports.release()


def _connect(viewer: Viewer, port: int) -> "ViewerClient":
    from rerun.experimental import ViewerClient

    deadline = time.monotonic() + _UP_S
    while True:
        with suppress(RuntimeError, ConnectionError):
            client = ViewerClient.connect(proxy_url(port))
            client.get_state()
            return client
        if viewer.ended:
            raise ViewerError(viewer.death() or "the viewer was closed")
        if time.monotonic() > deadline:
            raise ViewerError(f"the viewer did not come up in {_UP_S:.0f} s")
        time.sleep(_LOOK_S)


def _wait_loaded(client: "ViewerClient", viewer: Viewer, wanted: set[str]) -> None:
    """Wait until all that is wanted, and nothing else, is shown."""
    deadline = time.monotonic() + _UP_S
    while True:
        state = client.get_state()
        shown = {_id(recording) for recording in state.recordings}
        if shown == wanted and state.views and not state.loading:
            return
        if strange := ", ".join(sorted(shown - wanted)):
            raise ViewerError(f"the viewer shows {strange}, which is not asked for")
        if viewer.ended:
            raise ViewerError(viewer.death() or "the viewer was closed")
        if time.monotonic() > deadline:
            raise ViewerError(
                f"the viewer did not show {', '.join(sorted(wanted))} in {_UP_S:.0f} s"
            )
        time.sleep(_LOOK_S)


def _id(recording: "Recording") -> str:
    _, _, name = recording.store_id.split(":", 2)  # what, of which application
    return name


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
