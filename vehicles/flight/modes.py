"""What a vehicle can be doing, whatever a flight stack calls it."""

from enum import Enum


class Mode(Enum):
    """A flight mode; `personality.py` says which number and name each flight stack gives it."""

    STABILIZE = "stabilize"  # sticks are angles and thrust
    ALT_HOLD = "altitude hold"  # sticks are angles and a climb rate
    LOITER = "loiter"  # sticks are velocities; let go, it stays where it is
    MANUAL = "manual"  # a rover's sticks are throttle and steering
    HOLD = "hold"  # stop and stay here, whatever the sticks do
    GUIDED = "guided"  # follow setpoints
    TAKEOFF = "takeoff"  # climb to the takeoff height, then hold
    AUTO = "auto"  # fly the mission
    RTL = "return"  # go home and land or stop
    LAND = "land"
