"""Finding out who speaks behind addresses before anybody is wanted there."""

import select
import time
from collections.abc import Iterable

from .connect import Address
from .mavlink import Codec, mav
from .switchboard import Found, Switchboard

GROUND = 254, mav.MAV_COMP_ID_MISSIONPLANNER  # system and component id of our heartbeats
_HEARTBEAT_S = 1.0
_LOOK_S = 0.1


def hail(
    addresses: Iterable[Address], seconds: float, board: Switchboard | None = None
) -> tuple[Switchboard, list[Found]]:
    """Listen for `seconds`; return who was heard, and the open lines to them.

    Vehicles that are called at an address hear our heartbeats meanwhile, for many say nothing
    before. The lines stay open: `Switchboard.want` names the vehicles on them. With a `board` from
    before, go on with that.
    """
    board = board or Switchboard()
    codec = Codec(*GROUND)
    now = time.monotonic()
    end, call_at = now + seconds, now
    try:
        for address in addresses:
            board.listen(address)
        while (now := time.monotonic()) < end:
            if now >= call_at:
                board.call(codec.encode([_heartbeat()]))
                call_at = now + _HEARTBEAT_S
            select.select(board.sockets(), [], [], min(_LOOK_S, end - now))
            for _ in board.receive():
                pass  # nobody is wanted yet
    except BaseException:
        board.close()
        raise
    return board, board.found()


def _heartbeat() -> mav.MAVLink_heartbeat_message:
    return mav.MAVLink_heartbeat_message(
        mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, mav.MAV_STATE_ACTIVE, 3
    )
