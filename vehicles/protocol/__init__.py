"""What a vehicle says: one module for each MAVLink service."""
