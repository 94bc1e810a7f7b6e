"""01: arm, take off, go somewhere, land.

`python examples/01_first_flight.py` flies a simulated quadcopter, in no time at all;
`python examples/01_first_flight.py udpin:127.0.0.1:14550` the one that sends there. All examples
take addresses in this way: the same lines then fly what is found there.
"""

import sys

from mavherd.gcs import Fleet


def main(addresses: list[str]) -> None:
    """Fly once, over there."""
    with Fleet.connect(*addresses) if addresses else Fleet.from_scenario("one-quad") as fleet:
        quad = fleet["quad1"]
        quad.arm()  # each call waits until the vehicle itself says that it is so
        quad.takeoff(up=3)
        quad.goto(east=4, north=4, up=3)
        print(f"it is {quad.position}")
        quad.land()


if __name__ == "__main__":
    main(sys.argv[1:])
