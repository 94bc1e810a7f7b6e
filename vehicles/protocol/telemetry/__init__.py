"""Telemetry messages made from what the physics and the autopilot have; one module a theme."""

from .catalogue import MESSAGES
from .telemetry import Telemetry

__all__ = ["MESSAGES", "Telemetry"]
