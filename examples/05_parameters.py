"""05: read a parameter, change it, see what it does, put it back.

`python examples/05_parameters.py`, or with the address of a quadcopter.
"""

import sys

from mavherd.gcs import Fleet
from mavherd.gcs.script import Vehicle

# Names and units are the flight stack's own: what ArduPilot counts in cm/s, PX4 does in m/s.
LANDING = {"px4": ("MPC_LAND_SPEED", 1.2), "ardupilot": ("LAND_SPEED", 100)}


def main(addresses: list[str]) -> None:
    """Land slowly and fast, from the same height."""
    with Fleet.connect(*addresses) if addresses else Fleet.from_scenario("one-quad") as fleet:
        quad = fleet["quad1"]
        name, fast = LANDING[quad.autopilot]
        before = quad.param[name]
        print(f"{name} = {before:g}: down after {landing_time(quad):.1f} s")
        try:
            quad.param[name] = fast  # returns when the vehicle has said that it is so
            print(f"{name} = {quad.param[name]:g}: down after {landing_time(quad):.1f} s")
        finally:
            quad.param[name] = before  # a vehicle keeps what it is told, long after the script


def landing_time(quad: Vehicle) -> float:
    """Return how long it takes to land from 3 m."""
    quad.arm()
    quad.takeoff(up=3)
    began = quad.state.time
    quad.land()
    return quad.state.time - began


if __name__ == "__main__":
    main(sys.argv[1:])
