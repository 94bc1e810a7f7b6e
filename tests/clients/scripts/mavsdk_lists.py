"""Missions, fences and rally points as MAVSDK 4 scripts pass them."""

import asyncio
from typing import Any

from facts import distance, fact, offset
from mavsdk.asyncio.plugins.geofence import (
    Circle,
    FenceType,
    GeofenceAsync,
    GeofenceData,
    Point,
    Polygon,
)
from mavsdk.asyncio.plugins.mission import MissionAsync, MissionError, MissionItem, MissionPlan
from mavsdk.asyncio.plugins.mission_raw import MissionItem as RawItem
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk_drone import Drone, until

GLOBAL, RELATIVE, RELATIVE_INT = 0, 3, 6  # MAV_FRAME
WAYPOINT, RETURN, TAKEOFF = 16, 20, 22  # MAV_CMD
INCLUSION_VERTEX, EXCLUSION_CIRCLE, RALLY_POINT = 5001, 5004, 5100
FENCE, RALLY = 1, 2  # MAV_MISSION_TYPE
RALLY_POINTS = ((5, 5, 10), (-5, 5, 12))  # m north, east, up
CORNERS = ((0, 0, 6), (0, 8, 6), (8, 8, 7), (8, 0, 6))


async def fly_mission(drone: Drone) -> None:
    """Upload, download and fly a mission by the friendly plug-in."""
    mission = MissionAsync(drone.system)
    # On an ArduPilot item 0 is home: MAVSDK does not know, so the first one sent is lost.
    items = [_waypoint(drone, *corner) for corner in CORNERS[drone.px4 :]]
    await mission.upload_mission(MissionPlan(items))
    try:
        got = (await mission.download_mission()).mission_items
        pairs = zip(got, items, strict=True)
        fact(downloaded=len(got), apart=[distance(_at(a), _at(b)) for a, b in pairs])
    except MissionError as error:
        fact(download=error.result.name)
        # The failed download has made MAVSDK forget what it needs to tell progress.
        await mission.upload_mission(MissionPlan(items))
    watch = asyncio.create_task(_watch(mission))
    await mission.start_mission()
    fact(mission_steps=await watch, finished=await mission.is_mission_finished())


async def _watch(mission: MissionAsync) -> list[tuple[int, int]]:
    steps: list[tuple[int, int]] = []

    def is_done(progress: Any) -> bool:
        step = progress.current, progress.total
        if not steps or steps[-1] != step:
            steps.append(step)
        return progress.total > 0 and progress.current == progress.total

    await until(mission.subscribe_mission_progress(), is_done, patience=80)
    return steps


async def pass_raw_lists(drone: Drone) -> None:
    """Mission, fence and rally points go up and come back."""
    raw = MissionRawAsync(drone.system)
    mission = _raw_mission(drone)
    await raw.upload_mission(mission)
    fact(raw_sent=_told(mission), raw_got=_told(await raw.download_mission()))
    fence = [
        _raw(drone, i, INCLUSION_VERTEX, *at, 0, frame=GLOBAL, p1=4, kind=FENCE)
        for i, at in enumerate(_square(30))
    ]
    fence += [_raw(drone, 4, EXCLUSION_CIRCLE, 15, 15, 0, frame=GLOBAL, p1=3, kind=FENCE)]
    await raw.upload_geofence(fence)
    fact(fence_sent=_told(fence), fence_got=_told(await raw.download_geofence()))
    rally = [
        _raw(drone, i, RALLY_POINT, *at, frame=RELATIVE, kind=RALLY)
        for i, at in enumerate(RALLY_POINTS)
    ]
    await raw.upload_rally_points(rally)
    fact(rally_sent=_told(rally), rally_got=_told(await raw.download_rallypoints()))


async def fence_in(drone: Drone) -> None:
    """Pass a fence by the friendly plug-in, and take it away."""
    geofence = GeofenceAsync(drone.system)
    points = [Point(*offset(*drone.home, *at)) for at in _square(100)]
    circle = Circle(Point(*drone.home), 150.0, FenceType.INCLUSION)
    await geofence.upload_geofence(GeofenceData([Polygon(points, FenceType.INCLUSION)], [circle]))
    got = await geofence.download_geofence()
    fact(fence_points=len(got.polygons[0].points), fence_radius=got.circles[0].radius)
    await geofence.clear_geofence()


def _raw_mission(drone: Drone) -> list[RawItem]:
    home = [] if drone.px4 else [_raw(drone, 0, WAYPOINT, 0, 0, drone.ground, frame=GLOBAL)]
    rest = (TAKEOFF, 0, 0, 5), (WAYPOINT, 10, 0, 5), (WAYPOINT, 10, 10, 8), (RETURN, 0, 0, 0)
    return home + [_raw(drone, i, *item) for i, item in enumerate(rest, start=len(home))]


def _raw(
    drone: Drone,
    seq: int,
    command: int,
    north: float,
    east: float,
    up: float,
    *,
    frame: int = RELATIVE_INT,
    p1: float = 0.0,
    kind: int = 0,
) -> RawItem:
    lat, lon = offset(*drone.home, north, east)
    x, y = round(lat * 1e7), round(lon * 1e7)
    return RawItem(seq, frame, command, int(seq == 0), 1, p1, 0.0, 0.0, 0.0, x, y, up, kind)


def _told(items: list[RawItem]) -> list[list[float]]:
    return [[i.seq, i.command, i.param1, i.x, i.y, round(i.z, 2)] for i in items]


def _waypoint(drone: Drone, north: float, east: float, up: float) -> MissionItem:
    lat, lon = offset(*drone.home, north, east)
    nothing = float("nan")
    return MissionItem(
        latitude_deg=lat,
        longitude_deg=lon,
        relative_altitude_m=up,
        speed_m_s=5.0,
        is_fly_through=True,
        gimbal_pitch_deg=nothing,
        gimbal_yaw_deg=nothing,
        loiter_time_s=nothing,
        camera_photo_interval_s=1.0,
        acceptance_radius_m=1.0,
        yaw_deg=nothing,
        camera_photo_distance_m=nothing,
    )


def _at(item: MissionItem) -> tuple[float, float]:
    return item.latitude_deg, item.longitude_deg


def _square(side: float) -> list[tuple[float, float]]:
    half = side / 2
    return [(half, half), (half, -half), (-half, -half), (-half, half)]
