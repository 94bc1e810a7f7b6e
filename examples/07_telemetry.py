"""07: telemetry and events as plain values: a message, a table, a CSV file, what happened.

`python examples/07_telemetry.py`, or with the address of a quadcopter.
"""

import csv
import sys
from math import cos, sin

from mavherd.gcs import Fleet
from mavherd.gcs.script import Moving

RADIUS, TURN = 2.0, 0.4  # m, rad/s
SECONDS = 16  # once round


def circle(t: float) -> Moving:
    """Return where it shall be `t` seconds after it was told, and how fast."""
    east, north = RADIUS * cos(TURN * t), RADIUS * sin(TURN * t)
    return (east, north, 3), (-TURN * north, TURN * east, 0)


def main(addresses: list[str]) -> None:
    """Fly a circle and write it down."""
    with Fleet.connect(*addresses) if addresses else Fleet.from_scenario("one-quad") as fleet:
        quad = fleet["quad1"]
        battery = quad.wait_message("BATTERY_STATUS")  # any MAVLink message, asked for if need be
        print(f"battery: {battery['battery_remaining']} %")
        quad.arm()
        quad.takeoff(up=3)
        quad.goto(*circle(0)[0])
        quad.follow(circle)
        end = fleet.time + SECONDS
        with (fleet.folder / "telemetry.csv").open("w", newline="") as file:
            table = csv.writer(file)
            table.writerow(("time", "east", "north", "up", "v_east", "v_north", "v_up", "mode"))
            while fleet.time < end:
                fleet.sleep(0.5)
                state = quad.state  # one moment; quad.position and quad.mode may be two
                table.writerow((state.time, *state.position, *state.velocity, state.mode))
                print("{:6.1f} s  {:5.1f} {:5.1f} {:5.1f}".format(state.time, *state.position))
        quad.land()
        for event in fleet.events:
            print(f"{event.time:6.1f} s  {event.vehicle}: {event.kind}: {event.text}")
        print(f"written: {fleet.folder / 'telemetry.csv'}")


if __name__ == "__main__":
    main(sys.argv[1:])
