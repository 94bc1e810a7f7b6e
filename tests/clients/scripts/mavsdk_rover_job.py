"""MAVSDK 4 drives a rover. Argument: a connection URL."""

import asyncio
import sys

from facts import fact, offset
from mavsdk.asyncio.plugins.mission_raw import MissionItem, MissionRawAsync
from mavsdk.asyncio.plugins.offboard import (
    PositionNedYaw,
    VelocityBodyYawspeed,
    VelocityNedYaw,
)
from mavsdk_drone import Drone, connected, until


async def drive_offboard(drone: Drone) -> None:
    """Drive to a place, at a velocity, backwards, and turn on the spot."""
    offboard, telemetry = drone.offboard, drone.telemetry
    await offboard.set_position_ned(PositionNedYaw(6, 0, 0, 0))
    await offboard.start()
    await drone.be_at(6, 0, 0, within=1.5)
    fact(position=True)
    await offboard.set_velocity_ned(VelocityNedYaw(0, 1.0, 0, 90))
    await drone.fly_at(0, 1.0)
    await until(telemetry.subscribe_heading(), lambda h: abs(h.heading_deg - 90) < 15)
    fact(velocity=True)
    await offboard.set_velocity_body(VelocityBodyYawspeed(-0.8, 0, 0, 0))
    await until(telemetry.subscribe_velocity_ned(), lambda v: v.east_m_s < -0.5)
    fact(backwards=True)
    await offboard.set_velocity_body(VelocityBodyYawspeed(0, 0, 0, 30))
    turning = telemetry.subscribe_attitude_angular_velocity_body()
    await until(turning, lambda rate: rate.yaw_rad_s > 0.3)
    fact(turned=True)
    await offboard.stop()


async def drive_mission(drone: Drone) -> None:
    """Drive a raw mission to its end."""
    raw = MissionRawAsync(drone.system)
    items = []
    for seq, (north, east) in enumerate(((0, 0), (0, 5), (-5, 5))):
        lat, lon = (round(degrees * 1e7) for degrees in offset(*drone.home, north, east))
        items.append(MissionItem(seq, 6, 16, int(seq == 0), 1, 0, 0, 0, 0, lat, lon, 0, 0))
    await raw.upload_mission(items)
    await raw.start_mission()
    await drone.be_at(-5, 5, 0, within=2.5)
    fact(mission=True)


async def work(url: str) -> None:
    """Connect, then do one thing after the other."""
    async with connected(url) as drone:
        await drone.be_healthy()
        fact(vehicle=(await drone.system.vehicle_type()).name)
        await drone.arm()
        await drive_offboard(drone)
        await drive_mission(drone)
        await drone.action.hold()
        await drone.action.disarm()
        await drone.be_disarmed()
        fact(disarmed=True)


if __name__ == "__main__":
    asyncio.run(work(*sys.argv[1:]))
