"""06: upload a mission and let the vehicle fly it on its own.

`python examples/06_mission.py`, or with the address of a quadcopter.
"""

import sys

from mavherd.gcs import Fleet

POINTS = [(0, 0, 3), (5, 0, 3), (5, 4, 4), (0, 4, 3)]  # m east, north, up


def main(addresses: list[str]) -> None:
    """Fly through the points in AUTO.

    The vehicle needs nobody for it: it would go on if this script died. Nor does it give way to
    others, so the team keeps clear of it.
    """
    with Fleet.connect(*addresses) if addresses else Fleet.from_scenario("one-quad") as fleet:
        quad = fleet["quad1"]
        quad.arm()
        quad.takeoff(up=3)
        quad.mission(POINTS)  # waits until the last point is reached, then takes command again
        print(f"through after {fleet.time:.0f} s, in {quad.mode} at {quad.position}")
        for event in fleet.events:
            print(f"{event.time:6.1f} s  {event.vehicle}: {event.text}")
        quad.land()


if __name__ == "__main__":
    main(sys.argv[1:])
