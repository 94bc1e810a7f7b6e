"""What a user may set about a vehicle's behaviour: one neutral field, whatever a stack calls it.

Parameters write these fields (`vehicles/parameters/`), flight code reads them whenever it needs
them, so that a change counts at once. SI units, radians, up positive where a name says height.
"""

from dataclasses import dataclass, field
from enum import Enum

STREAM_GROUPS = (
    "RAW_SENS",
    "EXT_STAT",
    "RC_CHAN",
    "POSITION",
    "EXTRA1",
    "EXTRA2",
    "EXTRA3",
)
"""ArduPilot's groups of telemetry messages, as `SRn_...` and MAV_DATA_STREAM name them.

Those of which we have no message are left out.
"""

STREAM_CHANNELS = 4
"""SR0_ to SR3_: the first four links; later ones use the last."""


class Action(Enum):
    """What a failsafe or a breached fence does."""

    NONE = "nothing"
    WARN = "say so"
    HOLD = "stop and stay there"  # copter BRAKE, rover HOLD
    RTL = "return, or land where that is impossible"
    LAND = "land here"  # a rover holds
    DISARM = "disarm at once"


def _stream_rates() -> list[dict[str, float]]:
    return [dict.fromkeys(STREAM_GROUPS, 0.0) for _ in range(STREAM_CHANNELS)]


@dataclass(slots=True)
class Fence:
    """The fence around home. Polygons and circles of the fence list belong to the missions."""

    enabled: bool = False
    types: int = 7  # mask: 1 height, 2 circle around home, 4 fence list, 8 floor
    action: Action = Action.RTL
    radius: float = 300.0  # m around home, 0: no such limit
    height: float = 100.0  # m above home, 0: no such limit
    floor: float = -10.0  # m above home, the lowest height
    margin: float = 2.0  # m below `height` that RTL keeps, and before the edge that a rover stops
    avoidance: int = 3  # mask: 1 a rover in GUIDED brakes before the fence


@dataclass(slots=True)
class Battery:
    """The simulated battery and what happens as it empties. 0 V, mAh or charge: no such limit."""

    monitor: int = 4  # BATT_MONITOR: 0 none, 4 voltage and current
    capacity_mah: float = 3300.0
    full_voltage: float = 12.6  # V, at the start
    charge: float = 1.0  # at the start, 0..1
    low_voltage: float = 0.0  # V
    low_mah: float = 0.0  # mAh left
    low_charge: float = 0.0  # left, 0..1
    low_action: Action = Action.WARN
    low_timer: float = 10.0  # s that the voltage must be low
    critical_voltage: float = 0.0  # V
    critical_mah: float = 0.0  # mAh left
    critical_charge: float = 0.0  # left, 0..1
    critical_action: Action = Action.WARN
    arming_voltage: float = 0.0  # V, needed to arm
    arming_mah: float = 0.0  # mAh left, needed to arm


@dataclass(slots=True)
class Settings:
    """Everything that parameters say about flying, driving and talking; see the comments."""

    # Who commands
    gcs_system_id: int = 255  # whose sticks and heartbeats count (SYSID_MYGCS)
    gcs_enforced: bool = False  # obey no other ground station (SYSID_ENFORCE)

    # GUIDED and OFFBOARD
    guided_timeout: float = 3.0  # s until a velocity target expires
    guided_options: int = 0  # mask: 8 takes SET_ATTITUDE_TARGET's thrust as thrust
    targets_face_way: bool = False  # a copter's nose, where no yaw is given
    takeoff_height: float = 2.5  # m, when a takeoff names none
    cruise_speed: float = 0.0  # m/s, a rover's full throttle; 0: the robot's v_max
    offboard_loss_timeout: float = 1.0  # s without setpoints (PX4)
    offboard_loss_action: Action = Action.RTL

    # RTL and landing
    rtl_height: float = 15.0  # m above home to return at, unless already higher
    rtl_climb_min: float = 0.0  # m to climb in any case
    rtl_speed: float = 0.0  # m/s, 0: the usual speed
    rtl_loiter_time: float = 5.0  # s above home
    rtl_final_height: float = 0.0  # m above home to stay at, 0: land
    rally_limit: float = 300.0  # m: farther rally points are left out, 0: none is
    rally_home: bool = True  # home competes with the rally points
    land_speed: float = 0.5  # m/s near the ground
    land_speed_high: float = 0.0  # m/s above `land_slow_below`, 0: the robot's v_down_max
    land_slow_below: float = 10.0  # m above home

    # Arming
    arming_checks: int = 1  # mask, 1: all, 0: none
    arming_required: int = 1  # 0: is born armed
    disarm_delay: float = 10.0  # s on the ground, armed, without a takeoff; 0: never
    landed_disarm_delay: float = 0.3  # s on the ground after a landing (COM_DISARM_LAND)
    initial_mode: int | None = None  # `custom_mode` at boot, None: the flight stack's usual one

    # The pilot's sticks
    pilot_speed_up: float = 2.5  # m/s
    pilot_speed_down: float = 0.0  # m/s, 0: as up
    pilot_accel_z: float = 2.5  # m/s^2
    pilot_yaw_rate: float = 3.5342917352885173  # rad/s, 202.5 degrees a second
    throttle_deadzone: float = 0.1  # share of the throttle's travel on each side of its middle
    pilot_timeout: float = 3.0  # s until MANUAL_CONTROL and RC overrides expire

    # Missions
    mission_restart: bool = False  # entering AUTO begins anew
    waypoint_radius: float = 2.0  # m: this near a waypoint is reached

    # Failsafes
    gcs_failsafe: bool = True  # whether losing the ground station counts at all
    gcs_action: Action = Action.NONE
    gcs_timeout: float = 5.0  # s without a heartbeat of `gcs_system_id`
    pilot_loss_action: Action = Action.NONE  # sticks that were heard have gone silent
    pilot_loss_timeout: float = 1.5  # s of it (a rover's FS_TIMEOUT)
    failsafe_options: int = 0  # mask, FS_OPTIONS of ArduPilot
    fence: Fence = field(default_factory=Fence)
    battery: Battery = field(default_factory=Battery)

    # Telemetry
    stream_rates: list[dict[str, float]] = field(default_factory=_stream_rates)
    """Hz by channel and group of `STREAM_GROUPS`: 0 leaves each message at the vehicle's own
    rate, more sends every message of the group so often, less sends none of it."""
