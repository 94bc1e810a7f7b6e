"""The viewers of what is going on: opened when there is something to see, and looked after."""

import time
from contextlib import suppress
from pathlib import Path
from subprocess import TimeoutExpired

from .served import Ports, prepare
from .viewers import Viewer, ViewerError, Viewing, open_page, open_window

_FETCH_S = 5.0  # for a window that has just been opened to come up and get everything
_REST_S = 0.3  # for one that has long been there to get the rest


class Dashboard:
    """The viewers that a user wants of one recording, live.

    Raises MavherdError when they cannot be had, before anything is started. With `stays` the
    window is left open when the dashboard is closed: it has the data.
    """

    def __init__(self, viewing: Viewing, *, stays: bool) -> None:
        self._viewing = viewing
        self._stays = stays
        self._viewers: list[Viewer] = []
        self._opened_at: float | None = None
        self.ports: Ports = prepare(viewing)

    @property
    def page(self) -> str:
        """What to open in a browser, as long as it is served; else nothing."""
        served = any(viewer.name == "web server" and not viewer.ended for viewer in self._viewers)
        return self.ports.url if served else ""

    @property
    def window(self) -> Viewer | None:
        """The native viewer, once it is there."""
        return next((viewer for viewer in self._viewers if viewer.name == "viewer"), None)

    def open(self, log: Path) -> list[str]:
        """Start the viewers, once; return what to tell the user.

        Call it when the data is served: a viewer that comes too early never tries again.
        """
        if self._opened_at is not None:
            return []
        self._opened_at = time.monotonic()
        source = self.ports.source
        told = []
        try:
            if self._viewing.web:
                self._viewers.append(open_page(source, self.ports.data, self.ports.page, log))
                told.append(f"to see it in a browser: {self.ports.url}")
            if self._viewing.native:
                self._viewers.append(open_window(source, log, leash=not self._stays))
        except ViewerError as error:
            told.append(str(error))
        return told

    def look(self) -> list[str]:
        """Return what has become of the viewers since the last look that a user must know."""
        return [death for viewer in self._viewers if (death := viewer.death())]

    def wait_fetched(self, *, hurry: bool) -> None:
        """Leave a window the time to get what it will show when nothing is served any more.

        It does not tell what it has got; all is done in a moment after the first seconds.
        """
        window = self.window
        if window is None or self._opened_at is None:
            return
        young = self._opened_at + _FETCH_S - time.monotonic()
        with suppress(TimeoutExpired, KeyboardInterrupt):
            window.process.wait(_REST_S if hurry else max(_REST_S, young))

    def close(self) -> None:
        """End the page, and the window unless it stays; give back the ports."""
        for viewer in self._viewers:
            viewer.end()
        self.ports.release()
