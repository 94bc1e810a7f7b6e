"""A vehicle of each kind starts off in memory, before the real ones are born.

What Python makes of code when it first runs (specialised instructions, caches) is then in memory
that all children of this process share, instead of in each child's own.
"""

from ..transport.mavlink import Codec, Message, mav
from .config import VehicleConfig
from .lockstep import advance
from .truth import PlaceLog
from .vehicle import Vehicle

_TICKS = 60
_TICK_US = 50_000


def rehearse() -> None:
    """Have one of each kind armed and sent somewhere."""
    for kind, mode in (("quadcopter", 4), ("rover", 15)):
        vehicle, truth = Vehicle(VehicleConfig(kind=kind, system_id=1, name="")), PlaceLog()
        link, ground = vehicle.converse(channel=None), Codec(254, 190)
        cues = {
            2: _command(mav.MAV_CMD_DO_SET_MODE, mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, mode),
            3: _command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1),
            4: _command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 3),
        }
        for tick in range(1, _TICKS + 1):
            said = ground.encode([cues.get(tick) or _target()])
            advance(vehicle, link, [said], tick * _TICK_US, truth)


def _command(number: int, *params: float) -> Message:
    padded = (*params, *(0.0,) * (7 - len(params)))
    message: Message = mav.MAVLink_command_long_message(1, 1, number, 0, *padded)
    return message


def _target() -> Message:
    message: Message = mav.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, mav.MAV_FRAME_LOCAL_NED, 0, 9, 9, -3, 0, 0, 0, 0, 0, 0, 0, 0
    )
    return message
