"""What every part of the program may ask of a MAVLink message, whoever has made it."""

from typing import Any, Protocol


class Message(Protocol):
    """A message of the dialect; its fields are attributes under their MAVLink names."""

    def get_type(self) -> str:
        """Return the message's name, such as `HEARTBEAT`."""
        ...

    def get_srcSystem(self) -> int:  # noqa: N802 - pymavlink's name
        """Return the sender's system id."""
        ...

    def get_srcComponent(self) -> int:  # noqa: N802 - pymavlink's name
        """Return the sender's component id."""
        ...

    def __getattr__(self, name: str) -> Any: ...
