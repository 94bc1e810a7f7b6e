"""What the conductor of lockstep and a vehicle process say to one another."""

import struct

GRANT = struct.Struct("<qI")
"""Conductor to vehicle: simulate until this time (us); so many datagrams wait for you."""
DONE = struct.Struct("<qIIQ")
"""Vehicle to conductor: time reached (us), datagrams sent, outside clients so far, late slices."""

LIVENESS_S = 10.0  # wall-clock patience with a partner that is silent
