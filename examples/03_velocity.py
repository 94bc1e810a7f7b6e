"""03: a square flown by velocities alone, and how far from its start it ends.

`python examples/03_velocity.py`, or with the address of a quadcopter.
"""

import sys
from math import dist

from mavherd.gcs import Fleet

SIDES = (1, 0), (0, 1), (-1, 0), (0, -1)  # m/s east and north


def main(addresses: list[str]) -> None:
    """Fly the four sides, three seconds each, then mend what is left."""
    with Fleet.connect(*addresses) if addresses else Fleet.from_scenario("one-quad") as fleet:
        quad = fleet["quad1"]
        quad.arm()
        quad.takeoff(up=3)
        start = quad.position
        for east, north in SIDES:
            quad.velocity(east=east, north=north)  # returns at once, and holds until told else
            fleet.sleep(3)  # of the fleet's time: time.sleep would stop the simulated world
        quad.hold()
        fleet.sleep(2)
        # Nobody has looked at places until now, so the square need not be closed.
        print(f"it ends {dist(quad.position, start):.2f} m from where it began")
        quad.goto(*start)
        quad.land()


if __name__ == "__main__":
    main(sys.argv[1:])
