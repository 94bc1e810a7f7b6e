"""Commands on their way to one vehicle: asked until answered, and never two of one kind at once."""

from collections import deque
from dataclasses import dataclass, field

from ...transport.errors import VehicleError
from ...transport.mavlink import Message, mav
from .status import Texts, said_since

RETRY_S = 0.5  # between two tries of a command
TRIES = 5
_CANCELLED = 6  # MAV_RESULT, unknown to older dialects
_PROGRESS_S = 5.0  # patience with a vehicle that says IN_PROGRESS
_QUEUED = (mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAV_CMD_REQUEST_MESSAGE)


class StationError(VehicleError):
    """A vehicle that refuses or does not answer; the text repeats what it said."""


@dataclass(slots=True)
class Request:
    """One command on its way: `result` is None until the vehicle answers or tries run out."""

    command: int
    params: tuple[float, ...]
    what: str
    next_try: float
    heard: Texts  # what the vehicle says, as it goes on
    asked_at: float
    tries: int = 0
    result: int | None = None
    problem: str = ""

    @property
    def done(self) -> bool:
        """Whether there is an answer, or will be none."""
        return self.result is not None

    @property
    def accepted(self) -> bool:
        """Whether the vehicle said yes."""
        return self.result == mav.MAV_RESULT_ACCEPTED

    @property
    def refused(self) -> bool:
        """Whether the vehicle said no, or nothing."""
        return bool(self.problem)

    @property
    def error(self) -> str:
        """Return why it was not done; the vehicle's own reason often comes after its answer."""
        return self.problem + said_since(self.heard, self.asked_at)


@dataclass(slots=True)
class Commands:
    """The commands to one vehicle. An ACK says only which command it answers.

    So there is one of a kind at a time: a newer one takes the place of an older one, except that
    requests for messages and their rates wait for one another.
    """

    name: str
    system_id: int
    heard: Texts
    _under_way: dict[int, Request] = field(default_factory=dict)
    _waiting: dict[int, deque[Request]] = field(default_factory=dict)

    def ask(self, command: int, params: tuple[float, ...], what: str, now: float) -> Request:
        """Have a command sent as COMMAND_LONG; missing params are 0."""
        request = Request(command, params, what, now, self.heard, asked_at=now)
        older = self._under_way.get(command)
        if older is not None and command in _QUEUED:
            self._waiting.setdefault(command, deque()).append(request)
            return request
        if older is not None:
            self._end(older, _CANCELLED, f"overtaken by {what}")
        self._under_way[command] = request
        return request

    def refuse(self, command: int, what: str, now: float, reason: str) -> Request:
        """Return a request that is not even sent."""
        request = Request(command, (), what, now, self.heard, asked_at=now)
        request.result, request.problem = mav.MAV_RESULT_DENIED, f"{self.name}: {what}: {reason}"
        return request

    def is_asking(self, command: int) -> bool:
        """Return whether a command of this kind is on its way."""
        return command in self._under_way

    def take_ack(self, m: Message, now: float) -> None:
        """Take in a COMMAND_ACK."""
        request = self._under_way.get(m.command)
        if request is None:
            return
        if m.result == mav.MAV_RESULT_IN_PROGRESS:
            request.next_try = now + _PROGRESS_S
            return
        if m.result == mav.MAV_RESULT_ACCEPTED:
            self._end(request, m.result, "")
            return
        known = mav.enums["MAV_RESULT"].get(m.result)
        reason = known.name.removeprefix("MAV_RESULT_") if known else f"result {m.result}"
        self._end(request, m.result, f"{request.what} refused ({reason})")

    def due(self, now: float) -> list[Message]:
        """Return what is to be sent or sent again now."""
        out: list[Message] = []
        if not self._under_way:
            return out
        for request in list(self._under_way.values()):
            if now < request.next_try:
                continue
            if request.tries == TRIES:
                problem = f"no answer to {request.what} after {TRIES} tries"
                self._end(request, mav.MAV_RESULT_FAILED, problem)
                continue
            out.append(self.message(request.command, request.params, request.tries))
            request.tries += 1
            request.next_try = now + RETRY_S
        return out

    def message(self, command: int, params: tuple[float, ...], confirmation: int = 0) -> Message:
        """Return a COMMAND_LONG to the vehicle's autopilot."""
        filled = params + (0.0,) * (7 - len(params))
        m: Message = mav.MAVLink_command_long_message(
            self.system_id, mav.MAV_COMP_ID_AUTOPILOT1, command, confirmation, *filled
        )
        return m

    def _end(self, request: Request, result: int, problem: str) -> None:
        request.result = result
        request.problem = f"{self.name}: {problem}" if problem else ""
        del self._under_way[request.command]
        if waiting := self._waiting.get(request.command):
            self._under_way[request.command] = waiting.popleft()
