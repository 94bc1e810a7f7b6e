"""04: a quadcopter stays above a rover that drives round.

`python examples/04_follow_a_rover.py`, or with the addresses of a rover and a quadcopter.
"""

import sys

from mavherd.gcs import Fleet
from mavherd.gcs.script import Moving

HEIGHT = 3  # m: well above the rover, or the law would keep the quadcopter from over it
CORNERS = (4, 0), (4, 3), (0, 3), (0, 0)  # m east and north of where the rover stands


def main(addresses: list[str]) -> None:
    """Follow, then fly home: right below is a rover."""
    with Fleet.connect(*addresses) if addresses else Fleet.from_scenario("tracking") as fleet:
        rover, quad = fleet["rover1"], fleet["quad1"]
        pad, start = quad.position, rover.position
        both = fleet["rover1", "quad1"]
        both.arm()
        quad.takeoff(up=HEIGHT)
        quad.goto(start.east, start.north, HEIGHT)

        def above_the_rover(t: float) -> Moving:
            """Say where to be and how fast: without a velocity it would lag behind."""
            state = rover.state
            return (state.position.east, state.position.north, HEIGHT), state.velocity

        quad.follow(above_the_rover)  # asked at every tick from now on
        for east, north in CORNERS:
            rover.goto(start.east + east, start.north + north)
            print(f"rover at {rover.position}; quadcopter at {quad.position}")
        quad.goto(pad.east, pad.north, HEIGHT)
        both.land()


if __name__ == "__main__":
    main(sys.argv[1:])
