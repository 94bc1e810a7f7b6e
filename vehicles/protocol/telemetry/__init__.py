"""Telemetry messages made from what the physics and the autopilot have; one module a theme."""

from .catalogue import MESSAGES, name_of, note_of
from .telemetry import Telemetry

__all__ = ["MESSAGES", "Telemetry", "name_of", "note_of"]
