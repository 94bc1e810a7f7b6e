"""08: refusals, time-outs, a script with a mistake; and what becomes of the vehicle.

`python examples/08_when_things_go_wrong.py`, or with the address of a quadcopter.
"""

import sys

from mavherd.gcs import Fleet
from mavherd.gcs.script import FleetError, LinkLost, Refused, TakenOver, TimedOut, Vehicle


def main(addresses: list[str]) -> None:
    """Make mistakes on purpose, the last of them in mid-air."""
    fleet = Fleet.connect(*addresses) if addresses else Fleet.from_scenario("one-quad")
    try:
        with fleet:
            fly_badly(fleet["quad1"])
    except ZeroDivisionError:
        # The with block let the error through, but only after the vehicle was on the ground.
        print("the script failed in mid-air; the quadcopter has landed")


def fly_badly(quad: Vehicle) -> None:
    """Ask for what cannot be."""
    try:
        quad.goto(east=4, north=4)
    except Refused as error:  # in no state for it, or the vehicle says no: the text has its reason
        print(f"refused: {error}")
    try:
        quad.param["LAND_SPED"] = 30
    except Refused as error:
        print(f"refused: {error}")
    try:
        quad.wait_mode("LNAD")
    except FleetError as error:  # of all others: here a slip of the pen
        print(f"wrong: {error}")
    quad.arm()
    quad.takeoff(up=3)
    try:
        quad.goto(east=9, north=0, timeout=2)  # seconds of the vehicle's time
    except TimedOut as error:
        print(f"timed out: {error}")
        quad.hold()  # only the waiting is over: without this it would fly on
    except TakenOver:
        return  # a pilot has changed the mode, and must win: leave the vehicle to him
    except LinkLost:
        return  # for 10 s nothing was heard: it holds by its own time-out
    print(f"climb rate wanted: {1 / 0} m/s")


if __name__ == "__main__":
    main(sys.argv[1:])
