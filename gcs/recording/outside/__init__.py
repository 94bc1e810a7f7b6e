"""Vehicles that nobody here has started: what they tell over MAVLink, live or from a tlog."""
