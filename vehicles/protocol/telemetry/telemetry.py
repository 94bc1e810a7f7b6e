"""The one who makes telemetry: any message of the catalogue that this vehicle sends."""

from collections.abc import Callable
from math import isnan

from ....transport.extra_messages import AVAILABLE_MODES_ID, CURRENT_MODE_ID
from ....transport.mavlink import Message
from ...flight.autopilot import Autopilot
from ...robot import Robot
from . import identity
from .catalogue import MESSAGES
from .view import View


class Telemetry:
    """Makes any message the vehicle can send; `now_us` is its time since boot."""

    def __init__(self, autopilot: Autopilot, robot: Robot) -> None:
        self.autopilot = autopilot
        self.now_us = 0
        self._view = View(autopilot, robot)
        stack = autopilot.personality.name
        self._makers = {i: row.make for i, row in MESSAGES.items() if stack in row.stacks}
        self._lists_modes = CURRENT_MODE_ID in self._makers

    @property
    def ids(self) -> frozenset[int]:
        """Return every message that this vehicle sends, at a rate or on request."""
        return frozenset(self._makers) | ({AVAILABLE_MODES_ID} if self._lists_modes else set())

    def add(self, message_id: int, make: Callable[[], Message | None]) -> None:
        """Offer one more message, such as COMPONENT_METADATA."""
        self._makers[message_id] = lambda _: make()

    def offers(self, message_id: int) -> bool:
        """Return whether this vehicle sends a message at a rate."""
        return message_id in self._makers

    def make(self, message_id: int) -> Message | None:
        """Return a message as things are now; None when there is none to send."""
        maker = self._makers.get(message_id)
        if maker is None:
            return None
        self._view.now_us = self.now_us
        return maker(self._view)

    def request(self, message_id: int, index: float = 0.0) -> list[Message]:
        """Return what REQUEST_MESSAGE asks for; nothing means that it is refused.

        Of AVAILABLE_MODES, `index` is the number of a mode, and 0 (or no number) means all.
        """
        if message_id == AVAILABLE_MODES_ID and self._lists_modes:
            modes = identity.modes(self._view)
            if isnan(index) or index == 0:
                return modes
            return [m for m in modes if m.mode_index == index]
        message = self.make(message_id)
        return [] if message is None else [message]
