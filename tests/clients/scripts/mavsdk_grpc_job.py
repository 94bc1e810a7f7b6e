"""The older MAVSDK, through the server that it ships: one flight in short.

Arguments: a connection URL, and a free TCP port for the server.
"""

import asyncio
import contextlib
import sys
from collections.abc import AsyncGenerator, Callable
from typing import Any

from facts import distance, fact, offset
from mavsdk_grpc import System
from mavsdk_grpc.mission_raw import MissionItem, MissionRawError
from mavsdk_grpc.offboard import PositionNedYaw, VelocityNedYaw
from mavsdk_grpc.param import ParamError

PATIENCE = 60.0  # s
RELATIVE_INT = 6  # MAV_FRAME


async def until(
    stream: AsyncGenerator, condition: Callable[[Any], bool] = bool, patience: float = PATIENCE
) -> Any:
    """Return the first value of a subscription for which `condition` is true."""
    async with asyncio.timeout(patience), contextlib.aclosing(stream):
        async for value in stream:
            if condition(value):
                return value
    raise ConnectionError("the stream has ended")


class Job:
    """One vehicle behind one mavsdk_server."""

    def __init__(self, drone: System) -> None:
        self.drone = drone
        self.home = (0.0, 0.0)
        self.ground = 0.0  # m above mean sea level

    async def be_healthy(self) -> None:
        drone = self.drone
        await until(drone.core.connection_state(), lambda state: state.is_connected)
        await until(drone.telemetry.health_all_ok())
        health = await until(drone.telemetry.health(), lambda h: h.is_armable)
        home = await until(drone.telemetry.home(), lambda home: True)
        self.home = (home.latitude_deg, home.longitude_deg)
        self.ground = home.absolute_altitude_m
        version = await drone.info.get_version()
        fact(armable=health.is_armable, major=version.flight_sw_major)

    async def read_and_set_parameters(self) -> None:
        param = self.drone.param
        everything = await param.get_all_params()
        await param.set_param_int("RTL_ALT", 1300)
        await param.set_param_float("FENCE_RADIUS", 222.5)
        fact(
            int_params=len(everything.int_params),
            float_params=len(everything.float_params),
            rtl_alt=await param.get_param_int("RTL_ALT"),
            fence_radius=await param.get_param_float("FENCE_RADIUS"),
        )
        try:
            await param.get_param_float("NO_SUCH_PARAM")
        except ParamError as error:
            fact(unknown_param=error._result.result.name)

    async def pass_raw_missions(self) -> None:
        raw = self.drone.mission_raw
        sent = [self._item(0, 16, 0, 0, self.ground, frame=0), self._item(1, 22, 0, 0, 5)]
        sent += [self._item(2, 16, 8, 0, 6), self._item(3, 21, 0, 0, 0)]
        await raw.upload_mission(sent)
        got = await raw.download_mission()
        fact(sent=[_told(item) for item in sent], got=[_told(item) for item in got])
        try:
            await raw.upload_mission([*sent[:3], self._item(3, 31_000, 0, 0, 0)])
        except MissionRawError as error:
            fact(unknown_item=error._result.result.name)

    async def take_off(self) -> None:
        action = self.drone.action
        await action.set_takeoff_altitude(4.0)
        await action.arm()
        await action.takeoff()
        await self._be_at(0, 0, 4)
        await until(self.drone.telemetry.in_air())
        fact(took_off=True)

    async def fly(self) -> None:
        drone = self.drone
        lat, lon = offset(*self.home, 5, 5)
        await drone.action.goto_location(lat, lon, self.ground + 5, 0.0)
        await self._be_at(5, 5, 5)
        fact(went=True)
        await drone.offboard.set_velocity_ned(VelocityNedYaw(0, -2, 0, 0))
        await drone.offboard.start()
        await until(drone.telemetry.velocity_ned(), lambda v: abs(v.east_m_s + 2) < 0.4)
        fact(velocity=True)
        await drone.offboard.set_position_ned(PositionNedYaw(0, 0, -5, 0))
        await self._be_at(0, 0, 5)
        await drone.offboard.stop()
        fact(position=True)

    async def fly_mission(self) -> None:
        """The mission uploaded before: it ends with a landing."""
        raw = self.drone.mission_raw
        await raw.start_mission()
        steps: list[int] = []

        def is_last(progress: Any) -> bool:
            steps.append(progress.current)
            return progress.current >= 3

        await until(raw.mission_progress(), is_last)
        await until(self.drone.telemetry.armed(), lambda armed: not armed)
        fact(steps=sorted(set(steps)), landed=True)

    async def _be_at(self, north: float, east: float, up: float) -> None:
        there = offset(*self.home, north, east)
        await until(
            self.drone.telemetry.position(),
            lambda p: (
                distance((p.latitude_deg, p.longitude_deg), there) < 0.7
                and abs(p.relative_altitude_m - up) < 0.7
            ),
        )

    def _item(
        self, seq: int, command: int, north: float, east: float, up: float,
        frame: int = RELATIVE_INT,
    ) -> MissionItem:  # fmt: skip
        lat, lon = offset(*self.home, north, east)
        return MissionItem(
            seq, frame, command, int(seq == 0), 1, 0.0, 0.0, 0.0, 0.0,
            round(lat * 1e7), round(lon * 1e7), up, 0,
        )  # fmt: skip


def _told(item: MissionItem) -> list[float]:
    return [item.seq, item.command, item.x, item.y, round(item.z, 2)]


async def work(url: str, port: str) -> None:
    """Connect, then do one thing after the other."""
    drone = System(port=int(port))
    await drone.connect(system_address=url)
    job = Job(drone)
    await job.be_healthy()
    await job.read_and_set_parameters()
    await job.pass_raw_missions()
    await job.take_off()
    await job.fly()
    await job.fly_mission()


if __name__ == "__main__":
    asyncio.run(work(*sys.argv[1:]))
