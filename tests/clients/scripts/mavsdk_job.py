"""MAVSDK 4 (the native library): everything that a user's script does with one copter.

Arguments: a connection URL, and the autopilot that the vehicle says it is.
"""

import asyncio
import sys

from facts import fact, offset
from mavsdk.asyncio.plugins.manual_control import ManualControlAsync
from mavsdk.asyncio.plugins.offboard import (
    AccelerationNed,
    Attitude,
    PositionNedYaw,
    VelocityBodyYawspeed,
    VelocityNedYaw,
)
from mavsdk.asyncio.plugins.telemetry import LandedState
from mavsdk_drone import Drone, connected, until
from mavsdk_lists import RALLY_POINTS, fence_in, fly_mission, pass_raw_lists
from mavsdk_questions import (
    identify,
    listen_to_everything,
    read_and_set_parameters,
    use_small_plugins,
)


async def take_off(drone: Drone, height: float = 5.0) -> None:
    """Arm and take off, from LAND where that makes MAVSDK ask for BRAKE before it arms."""
    telemetry = drone.telemetry
    if not drone.px4:
        await drone.action.land()
        await until(telemetry.subscribe_flight_mode(), lambda m: m.name == "LAND")
    await drone.action.set_takeoff_altitude(height)
    said = asyncio.create_task(
        until(telemetry.subscribe_status_text(), lambda t: t.text.startswith("Arm"))
    )
    await asyncio.sleep(0)  # it listens now, before there is anything to hear
    await drone.arm()
    await drone.action.takeoff()
    await drone.be_at(0, 0, height)
    await until(telemetry.subscribe_in_air())
    fact(took_off=True, said=(await said).text)


async def go_to(drone: Drone, north: float, east: float, up: float) -> None:
    """Send the vehicle somewhere by one command."""
    await drone.action.goto_location(*offset(*drone.home, north, east), drone.ground + up, 90.0)
    await drone.be_at(north, east, up)
    fact(went_to=[north, east, up])


async def fly_by_stick(drone: Drone) -> None:
    """Push a joystick forward in altitude control."""
    if not drone.px4:  # an ArduPilot obeys the sticks of one station only
        await drone.param.set_param_int("SYSID_MYGCS", 245)
    sticks, telemetry = ManualControlAsync(drone.system), drone.telemetry
    await sticks.set_manual_control_input(0, 0, 0.5, 0)
    await sticks.start_altitude_control()

    async def push() -> None:
        while True:  # as often as a real joystick
            await sticks.set_manual_control_input(0.4, 0, 0.5, 0)
            await asyncio.sleep(0.05)

    pushing = asyncio.create_task(push())
    mode = await until(telemetry.subscribe_flight_mode(), lambda m: m.name == "ALTCTL")
    await until(telemetry.subscribe_attitude_euler(), lambda a: a.pitch_deg < -5)
    place = await until(telemetry.subscribe_position(), lambda p: drone.off(p, 6, -4) > 4)
    pushing.cancel()
    await drone.action.hold()
    fact(stick_mode=mode.name, stick_height=place.relative_altitude_m)


async def fly_offboard(drone: Drone) -> None:
    """Fly every kind of setpoint that both autopilots take."""
    offboard, telemetry = drone.offboard, drone.telemetry
    await offboard.set_position_ned(PositionNedYaw(0, 0, -6, 0))
    await offboard.start()
    await drone.be_at(0, 0, 6)
    fact(offboard_position=True, active=await offboard.is_active())
    await offboard.set_velocity_ned(VelocityNedYaw(2, 0, 0, 0))
    await drone.fly_at(2, 0)
    await offboard.set_velocity_body(VelocityBodyYawspeed(0, 1.5, 0, 0))
    await drone.fly_at(0, 1.5)
    fact(offboard_velocity=True)
    place, stop = PositionNedYaw(6, -3, -6, 0), VelocityNedYaw(0, 0, 0, 0)
    await offboard.set_position_velocity_ned(place, stop)
    await drone.be_at(6, -3, 6)
    fact(offboard_both=True)
    await offboard.set_acceleration_ned(AccelerationNed(0.5, 0, 0))
    await until(telemetry.subscribe_velocity_ned(), lambda v: v.north_m_s > 0.5)
    fact(offboard_acceleration=True)
    await offboard.set_attitude(Attitude(0, -5, 0, 0.5))
    await until(telemetry.subscribe_attitude_euler(), lambda a: a.pitch_deg < -3)
    fact(offboard_attitude=True)
    await offboard.set_position_ned(PositionNedYaw(0, 0, -6, 0))
    await drone.be_at(0, 0, 6)
    await offboard.stop()
    fact(offboard_stopped=True, active_after=await offboard.is_active())


async def come_back(drone: Drone) -> None:
    """Hold, return to the nearest rally point, land, and be disarmed by the vehicle itself."""
    action, telemetry = drone.action, drone.telemetry
    await action.hold()
    await action.return_to_launch()
    await until(telemetry.subscribe_flight_mode(), lambda m: m.name == "RETURN_TO_LAUNCH")
    north, east, _ = RALLY_POINTS[0]
    await until(telemetry.subscribe_position(), lambda p: drone.off(p, north, east) < 1)
    await action.land()
    await until(telemetry.subscribe_landed_state(), lambda s: s == LandedState.ON_GROUND)
    await drone.be_disarmed()
    fact(landed=True, off_rally_point=drone.off(await telemetry.position(), north, east))


async def arm_and_disarm(drone: Drone) -> None:
    """Arm again where it has landed."""
    await drone.arm()
    await drone.action.disarm()
    await drone.be_disarmed()
    fact(disarmed=True)


async def work(url: str, autopilot: str) -> None:
    """Connect, then do one thing after the other."""
    async with connected(url, px4=autopilot == "px4") as drone:
        await identify(drone)
        await drone.be_healthy()
        await read_and_set_parameters(drone)
        await listen_to_everything(drone)
        await use_small_plugins(drone)
        await pass_raw_lists(drone)
        await fence_in(drone)
        await take_off(drone)
        await go_to(drone, 6, -4, 5)
        await fly_by_stick(drone)
        await fly_offboard(drone)
        await fly_mission(drone)
        await come_back(drone)
        await arm_and_disarm(drone)


if __name__ == "__main__":
    asyncio.run(work(*sys.argv[1:]))
