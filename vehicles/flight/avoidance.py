"""Stop before the fence, as ArduRover does: in GUIDED no speed carries a rover out of it."""

from math import hypot, sqrt
from typing import TYPE_CHECKING

from ..robot import AttitudeSetpoint, Setpoint, Vec3

if TYPE_CHECKING:
    from .autopilot import Autopilot

_BRAKING = 0.5  # m/s^2: half of what a rover's wheels are asked for
_STEP = 0.5  # m between two looks ahead
_HALVINGS = 7  # of a step, to find the edge
_FARTHEST = 50.0  # m ahead that matter to anybody
_CRAWL = 0.01  # m/s: slower is to stand


def within_fence(
    autopilot: "Autopilot", setpoint: Setpoint | AttitudeSetpoint
) -> Setpoint | AttitudeSetpoint:
    """Return the setpoint, its speed reduced to one that can be braked from before the fence.

    FENCE_MARGIN is left to the edge. Targets that are places are refused beyond the fence anyway;
    a vehicle that is already outside is left alone.
    """
    if not autopilot.fence.enabled:
        return setpoint
    k = autopilot.robot.kinematics()
    full = 1.0
    if isinstance(setpoint, AttitudeSetpoint):
        full = autopilot.robot.limits.speed
        share = setpoint.thrust or 0.0
        cos_yaw, sin_yaw = 1 - 2 * k.qz * k.qz, 2 * k.qw * k.qz
        north, east = share * cos_yaw * full, share * sin_yaw * full
    elif setpoint.velocity is None or setpoint.position is not None:
        return setpoint
    else:
        north, east, _ = setpoint.velocity
    speed = hypot(north, east)
    if speed < _CRAWL:
        return setpoint
    margin = autopilot.settings.fence.margin
    braking = min(speed, autopilot.robot.limits.speed) ** 2 / (2 * _BRAKING)
    most = min(_FARTHEST, braking + margin)
    way = _way_ahead(autopilot, (north / speed, east / speed), most)
    allowed = sqrt(2 * _BRAKING * max(0.0, way - margin)) if way < most else speed
    if allowed >= speed:
        return setpoint
    scale = allowed / speed if allowed > _CRAWL else 0.0
    if isinstance(setpoint, AttitudeSetpoint):
        return setpoint._replace(thrust=(setpoint.thrust or 0.0) * scale)
    return setpoint._replace(velocity=Vec3(north * scale, east * scale, 0.0))


def _way_ahead(autopilot: "Autopilot", direction: tuple[float, float], most: float) -> float:
    """Return how far (m) it is to the fence's edge in a direction (north, east), at most `most`."""
    fence, k = autopilot.fence, autopilot.robot.kinematics()

    def is_free(way: float) -> bool:
        north, east = direction
        return fence.allows(Vec3(k.north + way * north, k.east + way * east, k.down))

    free = 0.0
    if not is_free(free):
        return most  # outside already: it is the breach that counts
    while free < most:
        ahead = min(free + _STEP, most)
        if not is_free(ahead):
            for _ in range(_HALVINGS):
                middle = (free + ahead) / 2
                free, ahead = (middle, ahead) if is_free(middle) else (free, middle)
            return free
        free = ahead
    return most
