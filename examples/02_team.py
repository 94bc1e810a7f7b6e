"""02: a team that does things together: everybody goes to the place of the next one.

`python examples/02_team.py`, or with an address or several: then with all who are there.
"""

import sys
from itertools import combinations
from math import dist, inf

from mavherd.gcs import Fleet


def main(addresses: list[str]) -> None:
    """Change places: some must meet head-on, and the law `safe` keeps them apart."""
    scenario = "crossing-targets"
    with Fleet.connect(*addresses) if addresses else Fleet.from_scenario(scenario) as fleet:
        fleet.all.arm()
        fleet.all.takeoff(up=3)  # the rovers stay on the ground
        for kind in ("quadcopter", "rover"):
            team = [vehicle for vehicle in fleet if vehicle.kind == kind]
            places = [vehicle.position for vehicle in team]
            for vehicle, place in zip(team, places[1:] + places[:1], strict=True):
                vehicle.goto(*place, wait=False)  # all are on their way before any arrives

        closest = inf

        def all_have_arrived() -> bool:
            nonlocal closest
            gaps = (dist(a.position, b.position) for a, b in combinations(fleet, 2))
            closest = min(closest, *gaps, inf)
            return all(vehicle.arrived for vehicle in fleet)

        fleet.wait(all_have_arrived)  # looked at once a tick
        print(f"no two came nearer than {closest:.2f} m")
        fleet.all.land()


if __name__ == "__main__":
    main(sys.argv[1:])
