"""A mixed air-ground MAVLink fleet: vehicles, transport, scenarios and ground control."""

__version__ = "0.1.0"
