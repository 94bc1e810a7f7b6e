"""Something asked that is answered by more than one COMMAND_ACK: a parameter, a mission."""

from dataclasses import dataclass

from .status import Texts, said_since


@dataclass(slots=True)
class Question:
    """What was asked, and its answer: `value` once `accepted`, `error` once `refused`."""

    what: str
    heard: Texts  # what the vehicle says, as it goes on
    asked_at: float
    value: float | None = None
    accepted: bool = False
    problem: str = ""

    @property
    def done(self) -> bool:
        """Whether there is an answer, or will be none."""
        return self.accepted or self.refused

    @property
    def refused(self) -> bool:
        """Whether the vehicle said no, or nothing."""
        return bool(self.problem)

    @property
    def error(self) -> str:
        """Return why it was not done, with what the vehicle has said since."""
        return self.problem + said_since(self.heard, self.asked_at) if self.problem else ""
