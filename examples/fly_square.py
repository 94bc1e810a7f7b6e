"""Fly a square with a stock MAVLink client; nothing here knows of mavherd.

Start `mavherd vehicle quadcopter`, then run `python examples/fly_square.py tcp:127.0.0.1:5760`
(or `udpin:127.0.0.1:14540`).
"""

import sys
import time
from math import dist

from pymavlink import mavutil
from pymavlink.mavutil import mavlink

CORNERS = (5, 0, -3), (5, 5, -3), (0, 5, -3), (0, 0, -3)  # m north, east, down
POSITION_ONLY = 0xDF8  # type_mask: ignore velocity, acceleration, yaw and yaw rate


def wait(vehicle, kind, test, timeout=60):
    """Wait for a message of this kind that passes the test."""
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        message = vehicle.recv_match(type=kind, blocking=True, timeout=1)
        if message and test(message):
            return message
    sys.exit(f"no such {kind} within {timeout} s")


def command(vehicle, number, *params):
    """Send a command and insist that it is accepted."""
    params += (0,) * (7 - len(params))
    vehicle.mav.command_long_send(vehicle.target_system, 1, number, 0, *params)
    ack = wait(vehicle, "COMMAND_ACK", lambda m: m.command == number, timeout=5)
    if ack.result != mavlink.MAV_RESULT_ACCEPTED:
        sys.exit(f"command {number} refused, result {ack.result}")


def go_to(vehicle, corner):
    """Fly to a place and wait until the vehicle is there."""
    where = (0, vehicle.target_system, 1, mavlink.MAV_FRAME_LOCAL_NED, POSITION_ONLY, *corner)
    vehicle.mav.set_position_target_local_ned_send(*where, *[0] * 8)
    wait(vehicle, "LOCAL_POSITION_NED", lambda m: dist((m.x, m.y, m.z), corner) < 0.2)
    print(f"at {corner}")


def main(argv):
    """Take off, fly the square, land."""
    vehicle = mavutil.mavlink_connection(argv[0] if argv else "udpin:127.0.0.1:14540")
    vehicle.wait_heartbeat()
    print(f"connected to system {vehicle.target_system}")
    vehicle.set_mode("GUIDED")
    wait(vehicle, "HEARTBEAT", lambda m: vehicle.flightmode == "GUIDED")
    command(vehicle, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    command(vehicle, mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 3)
    print("armed, taking off")
    wait(vehicle, "LOCAL_POSITION_NED", lambda m: m.z < -2.8)
    for corner in CORNERS:
        go_to(vehicle, corner)
    command(vehicle, mavlink.MAV_CMD_NAV_LAND)
    wait(vehicle, "HEARTBEAT", lambda m: not m.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
    print("landed and disarmed")
    vehicle.close()


if __name__ == "__main__":
    main(sys.argv[1:])
