"""MAVSDK 4 (the native library): everything that a user's script does with one copter.

Arguments: a connection URL, and the autopilot that the vehicle says it is.
"""

import asyncio
import contextlib
import sys
from collections.abc import AsyncGenerator, Callable
from typing import Any

from facts import distance, fact, offset
from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.geofence import (
    Circle,
    FenceType,
    GeofenceAsync,
    GeofenceData,
    Point,
    Polygon,
)
from mavsdk.asyncio.plugins.info import InfoAsync
from mavsdk.asyncio.plugins.mission import MissionAsync, MissionError, MissionItem, MissionPlan
from mavsdk.asyncio.plugins.mission_raw import MissionItem as RawItem
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.asyncio.plugins.offboard import (
    AccelerationNed,
    Attitude,
    OffboardAsync,
    PositionNedYaw,
    VelocityBodyYawspeed,
    VelocityNedYaw,
)
from mavsdk.asyncio.plugins.param import ParamAsync, ParamError
from mavsdk.asyncio.plugins.telemetry import LandedState, TelemetryAsync, TelemetryError

PATIENCE = 40.0  # s
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
    """One vehicle and the plug-ins that talk to it."""

    def __init__(self, system: Any, autopilot: str) -> None:
        self.system = system
        self.px4 = autopilot == "px4"
        self.action = ActionAsync(system)
        self.telemetry = TelemetryAsync(system)
        self.offboard = OffboardAsync(system)
        self.mission = MissionAsync(system)
        self.raw = MissionRawAsync(system)
        self.param = ParamAsync(system)
        self.home = (0.0, 0.0)
        self.ground = 0.0  # m above mean sea level

    async def identify(self) -> None:
        version = await InfoAsync(self.system).get_version()
        fact(
            autopilot=(await self.system.autopilot_type()).name,
            vehicle=(await self.system.vehicle_type()).name,
            components=await self.system.component_ids(),
            version=[version.flight_sw_major, version.flight_sw_minor],
        )

    async def be_healthy(self) -> None:
        await until(self.telemetry.subscribe_health_all_ok())
        health = await until(self.telemetry.subscribe_health(), lambda h: h.is_armable)
        home = await until(self.telemetry.subscribe_home())
        self.home = (home.latitude_deg, home.longitude_deg)
        self.ground = home.absolute_altitude_m
        fact(healthy=True, armable=health.is_armable, home=self.home, ground=self.ground)

    async def read_and_set_parameters(self) -> None:
        everything = await self.param.get_all_params()
        fact(int_params=len(everything.int_params), float_params=len(everything.float_params))
        an_int, a_float = (
            ("COM_DL_LOSS_T", "MPC_XY_CRUISE") if self.px4 else ("RTL_ALT", "FENCE_RADIUS")
        )
        await self.param.set_param_int(an_int, 20 if self.px4 else 1200)
        await self.param.set_param_float(a_float, 7.5 if self.px4 else 123.5)
        refusals = {}
        for why, call in {
            "unknown": self.param.get_param_int("NO_SUCH_PARAM"),
            "wrong type": self.param.set_param_int(a_float, 3),
        }.items():
            try:
                await call
            except ParamError as error:
                refusals[why] = error.result.name
        fact(
            params={
                an_int: await self.param.get_param_int(an_int),
                a_float: await self.param.get_param_float(a_float),
            },
            param_refusals=refusals,
        )

    async def listen_to_everything(self) -> None:
        """Subscribe to each stream there is, at 10 Hz where a rate can be asked for."""
        offers = {
            name.removeprefix("subscribe_"): getattr(self.telemetry, name)
            for name in dir(self.telemetry)
            if name.startswith("subscribe_")
        }
        refused = {}
        for name in offers:
            if set_rate := getattr(self.telemetry, f"set_rate_{name}", None):
                try:
                    await set_rate(10.0)
                except TelemetryError as error:
                    refused[name] = error.result.name

        async def hear(name: str) -> tuple[str, str | None]:
            try:
                return name, str(await until(offers[name](), lambda value: True, patience=5))
            except TimeoutError:
                return name, None

        heard = dict(await asyncio.gather(*(hear(n) for n in offers if n != "status_text")))
        fact(
            heard={name: value for name, value in heard.items() if value is not None},
            silent=sorted(name for name, value in heard.items() if value is None),
            rates_refused=refused,
        )

    async def take_off(self, height: float = 5.0) -> None:
        if not self.px4:  # where arming after LAND makes MAVSDK ask for BRAKE first
            await self.action.land()
            await until(self.telemetry.subscribe_flight_mode(), lambda m: m.name == "LAND")
        await self.action.set_takeoff_altitude(height)
        texts = self.telemetry.subscribe_status_text()
        said = asyncio.create_task(until(texts, lambda t: "rm" in t.text))
        await self.action.arm()
        await until(self.telemetry.subscribe_armed())
        await self.action.takeoff()
        await self._be_at(0, 0, height)
        await until(self.telemetry.subscribe_in_air())
        fact(took_off=True, said=(await said).text)

    async def go_to(self, north: float, east: float, up: float) -> None:
        lat, lon = offset(*self.home, north, east)
        await self.action.goto_location(lat, lon, self.ground + up, 90.0)
        await self._be_at(north, east, up)
        fact(went_to=[north, east, up])

    async def fly_offboard(self) -> None:
        """Every kind of setpoint that both autopilots take."""
        offboard = self.offboard
        await offboard.set_position_ned(PositionNedYaw(0, 0, -6, 0))
        await offboard.start()
        await self._be_at(0, 0, 6)
        fact(offboard_position=True, active=await offboard.is_active())
        await offboard.set_velocity_ned(VelocityNedYaw(2, 0, 0, 0))
        await self._fly_at(2, 0)
        await offboard.set_velocity_body(VelocityBodyYawspeed(0, 1.5, 0, 0))
        await self._fly_at(0, 1.5)
        fact(offboard_velocity=True)
        await offboard.set_position_velocity_ned(
            PositionNedYaw(3, 2, -6, 0), VelocityNedYaw(0, 0, 0, 0)
        )
        await self._be_at(3, 2, 6)
        fact(offboard_both=True)
        await offboard.set_acceleration_ned(AccelerationNed(0.5, 0, 0))
        await until(self.telemetry.subscribe_velocity_ned(), lambda v: v.north_m_s > 0.5)
        fact(offboard_acceleration=True)
        await offboard.set_attitude(Attitude(0, -5, 0, 0.5))
        await until(self.telemetry.subscribe_attitude_euler(), lambda a: a.pitch_deg < -3)
        fact(offboard_attitude=True)
        await offboard.set_position_ned(PositionNedYaw(0, 0, -6, 0))
        await self._be_at(0, 0, 6)
        await offboard.stop()
        fact(offboard_stopped=True, active=await offboard.is_active())

    async def fly_mission(self) -> None:
        # On an ArduPilot item 0 is home: MAVSDK does not know, so the first one sent is lost.
        corners = ((0, 0, 6), (0, 8, 6), (8, 8, 7), (8, 0, 6))
        items = [self._waypoint(*corner) for corner in corners[self.px4 :]]
        await self.mission.upload_mission(MissionPlan(items))
        try:
            downloaded = (await self.mission.download_mission()).mission_items
            fact(
                downloaded=len(downloaded),
                places=[
                    distance((a.latitude_deg, a.longitude_deg), (b.latitude_deg, b.longitude_deg))
                    for a, b in zip(downloaded, items, strict=False)
                ],
            )
        except MissionError as error:
            fact(download=error.result.name)
            # The failed download has made MAVSDK forget what it needs to tell progress.
            await self.mission.upload_mission(MissionPlan(items))
        watch = asyncio.create_task(self._watch_mission())
        await self.mission.start_mission()
        steps = await watch
        fact(mission_steps=steps, finished=await self.mission.is_mission_finished())

    async def pass_raw_missions(self) -> None:
        """Mission, fence and rally points go up and come back the same."""
        sent = self._raw_mission()
        await self.raw.upload_mission(sent)
        got = await self.raw.download_mission()
        fence = [self._raw(i, 5001, *at, p1=4) for i, at in enumerate(_square(30))]
        fence += [self._raw(4, 5004, 15, 15, 0, p1=3)]
        await self.raw.upload_geofence([_typed(item, 1) for item in fence])
        fence_got = await self.raw.download_geofence()
        rally = [self._raw(0, 5100, 5, 5, 10, frame=3), self._raw(1, 5100, -5, 5, 12, frame=3)]
        await self.raw.upload_rally_points([_typed(item, 2) for item in rally])
        rally_got = await self.raw.download_rallypoints()
        fact(
            raw_sent=[_told(i) for i in sent],
            raw_got=[_told(i) for i in got],
            fence_sent=[_told(i) for i in fence],
            fence_got=[_told(i) for i in fence_got],
            rally_sent=[_told(i) for i in rally],
            rally_got=[_told(i) for i in rally_got],
        )

    async def fence_in(self) -> None:
        """Use the friendly fence plug-in too."""
        geofence = GeofenceAsync(self.system)
        points = [Point(*offset(*self.home, *at[:2])) for at in _square(100)]
        circle = Circle(Point(*self.home), 150.0, FenceType.INCLUSION)
        await geofence.upload_geofence(
            GeofenceData([Polygon(points, FenceType.INCLUSION)], [circle])
        )
        got = await geofence.download_geofence()
        fact(fence_points=len(got.polygons[0].points), fence_radius=got.circles[0].radius)
        await geofence.clear_geofence()

    async def come_home(self) -> None:
        await self.action.hold()
        await self.action.return_to_launch()
        await until(self.telemetry.subscribe_flight_mode(), lambda m: m.name == "RETURN_TO_LAUNCH")
        await until(self.telemetry.subscribe_position(), lambda p: self._off(p, 0, 0) < 1)
        await self.action.land()
        on_ground = LandedState.ON_GROUND
        await until(self.telemetry.subscribe_landed_state(), lambda s: s == on_ground)
        await until(self.telemetry.subscribe_armed(), lambda armed: not armed)
        fact(landed=True, off_home=self._off(await self.telemetry.position(), 0, 0))

    async def arm_and_disarm(self) -> None:
        await self.action.arm()
        await until(self.telemetry.subscribe_armed())
        await self.action.disarm()
        await until(self.telemetry.subscribe_armed(), lambda armed: not armed)
        fact(disarmed=True)

    async def _be_at(self, north: float, east: float, up: float) -> None:
        await until(
            self.telemetry.subscribe_position(),
            lambda p: self._off(p, north, east) < 0.7 and abs(p.relative_altitude_m - up) < 0.7,
        )

    def _off(self, place: Any, north: float, east: float) -> float:
        """Return how far off in the plane the vehicle is, m."""
        there = offset(*self.home, north, east)
        return distance((place.latitude_deg, place.longitude_deg), there)

    async def _fly_at(self, north: float, east: float) -> None:
        await until(
            self.telemetry.subscribe_velocity_ned(),
            lambda v: abs(v.north_m_s - north) < 0.4 and abs(v.east_m_s - east) < 0.4,
        )

    async def _watch_mission(self) -> list[tuple[int, int]]:
        steps: list[tuple[int, int]] = []

        def is_done(progress: Any) -> bool:
            step = progress.current, progress.total
            if not steps or steps[-1] != step:
                steps.append(step)
            return progress.total > 0 and progress.current == progress.total

        await until(self.mission.subscribe_mission_progress(), is_done, patience=80)
        return steps

    def _waypoint(self, north: float, east: float, up: float) -> MissionItem:
        lat, lon = offset(*self.home, north, east)
        return MissionItem(
            latitude_deg=lat,
            longitude_deg=lon,
            relative_altitude_m=up,
            speed_m_s=5.0,
            is_fly_through=True,
            gimbal_pitch_deg=float("nan"),
            gimbal_yaw_deg=float("nan"),
            loiter_time_s=float("nan"),
            camera_photo_interval_s=1.0,
            acceptance_radius_m=1.0,
            yaw_deg=float("nan"),
            camera_photo_distance_m=float("nan"),
        )

    def _raw(
        self, seq: int, command: int, north: float, east: float, up: float, *,
        frame: int = RELATIVE_INT, p1: float = 0.0, p2: float = 0.0,
    ) -> RawItem:  # fmt: skip
        lat, lon = offset(*self.home, north, east)
        return RawItem(
            seq, frame, command, int(seq == 0), 1, p1, p2, 0.0, 0.0,
            round(lat * 1e7), round(lon * 1e7), up, 0,
        )  # fmt: skip

    def _raw_mission(self) -> list[RawItem]:
        home = [] if self.px4 else [self._raw(0, 16, 0, 0, self.ground, frame=0)]  # item 0
        rest = ((22, 0, 0, 5), (16, 10, 0, 5), (16, 10, 10, 8), (20, 0, 0, 0))
        return home + [self._raw(i, *item) for i, item in enumerate(rest, start=len(home))]


def _square(side: float) -> list[tuple[float, float, float]]:
    half = side / 2
    return [(half, half, 0), (half, -half, 0), (-half, -half, 0), (-half, half, 0)]


def _typed(item: RawItem, mission_type: int) -> RawItem:
    item.mission_type = mission_type
    return item


def _told(item: RawItem) -> list[float]:
    return [item.seq, item.command, item.param1, item.x, item.y, round(item.z, 2)]


async def work(url: str, autopilot: str) -> None:
    """Connect, then do one thing after the other."""
    station = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(station) as mavsdk:
        await mavsdk.add_any_connection(url)
        system = await mavsdk.first_autopilot(timeout_s=15.0)
        if system is None:
            raise ConnectionError("no autopilot")
        job = Job(system, autopilot)
        fact(connected=True)
        await job.identify()
        await job.be_healthy()
        await job.read_and_set_parameters()
        await job.listen_to_everything()
        await job.pass_raw_missions()
        await job.fence_in()
        await job.take_off()
        await job.go_to(6, -4, 5)
        await job.fly_offboard()
        await job.fly_mission()
        await job.come_home()
        await job.arm_and_disarm()


if __name__ == "__main__":
    asyncio.run(work(*sys.argv[1:]))
