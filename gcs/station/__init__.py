"""The MAVLink client of one vehicle: what it says of itself, and what it is asked to do. No I/O."""

from .commands import RETRY_S, TRIES, Request, StationError
from .missions import MissionClient, MissionItem, plan
from .parameters import ParameterClient
from .question import Question
from .stacks import ARDUPILOT, GENERIC, PX4, STACKS, FlightStack, stack_of
from .station import COMPONENT_ID, SYSTEM_ID, Station, Tap
from .status import KEPT_TEXTS, Text, Texts, VehicleStatus, said_since

__all__ = [
    "ARDUPILOT",
    "COMPONENT_ID",
    "GENERIC",
    "KEPT_TEXTS",
    "PX4",
    "RETRY_S",
    "STACKS",
    "SYSTEM_ID",
    "TRIES",
    "FlightStack",
    "MissionClient",
    "MissionItem",
    "ParameterClient",
    "Question",
    "Request",
    "Station",
    "StationError",
    "Tap",
    "Text",
    "Texts",
    "VehicleStatus",
    "plan",
    "said_since",
    "stack_of",
]
