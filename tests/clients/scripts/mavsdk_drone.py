"""What MAVSDK 4's scripts share: one vehicle, the plug-ins that talk to it, and waiting."""

import asyncio
import contextlib
from collections.abc import AsyncGenerator, Callable
from typing import Any

from facts import distance, fact, offset
from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync

PATIENCE = 60.0  # s


async def until(
    stream: AsyncGenerator, condition: Callable[[Any], bool] = bool, patience: float = PATIENCE
) -> Any:
    """Return the first value of a subscription for which `condition` is true."""
    async with asyncio.timeout(patience), contextlib.aclosing(stream):
        async for value in stream:
            if condition(value):
                return value
    raise ConnectionError("the stream has ended")


class Drone:
    """One vehicle."""

    def __init__(self, system: Any, *, px4: bool) -> None:
        self.system = system
        self.px4 = px4
        self.action = ActionAsync(system)
        self.telemetry = TelemetryAsync(system)
        self.offboard = OffboardAsync(system)
        self.param = ParamAsync(system)
        self.home = (0.0, 0.0)
        self.ground = 0.0  # m above mean sea level

    async def be_healthy(self) -> None:
        """Wait until MAVSDK finds nothing amiss."""
        await until(self.telemetry.subscribe_health_all_ok())
        health = await until(self.telemetry.subscribe_health(), lambda h: h.is_armable)
        home = await until(self.telemetry.subscribe_home())
        self.home = (home.latitude_deg, home.longitude_deg)
        self.ground = home.absolute_altitude_m
        fact(healthy=True, armable=health.is_armable)

    async def arm(self) -> None:
        await self.action.arm()
        await until(self.telemetry.subscribe_armed())

    async def be_disarmed(self) -> None:
        await until(self.telemetry.subscribe_armed(), lambda armed: not armed)

    async def be_at(self, north: float, east: float, up: float, within: float = 0.7) -> None:
        """Wait until the vehicle is there, m from home."""
        await until(
            self.telemetry.subscribe_position(),
            lambda p: (
                self.off(p, north, east) < within and abs(p.relative_altitude_m - up) < within
            ),
        )

    async def fly_at(self, north: float, east: float) -> None:
        """Wait until the vehicle has this velocity, m/s."""
        await until(
            self.telemetry.subscribe_velocity_ned(),
            lambda v: abs(v.north_m_s - north) < 0.4 and abs(v.east_m_s - east) < 0.4,
        )

    def off(self, place: Any, north: float, east: float) -> float:
        """Return how far off in the plane a position is, m."""
        there = offset(*self.home, north, east)
        return distance((place.latitude_deg, place.longitude_deg), there)


@contextlib.asynccontextmanager
async def connected(url: str, *, px4: bool = False) -> AsyncGenerator[Drone]:
    """Connect to a vehicle as a ground station does."""
    station = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(station) as mavsdk:
        await mavsdk.add_any_connection(url)
        system = await mavsdk.first_autopilot(timeout_s=PATIENCE)
        if system is None:
            raise ConnectionError("no autopilot")
        fact(connected=True)
        yield Drone(system, px4=px4)
