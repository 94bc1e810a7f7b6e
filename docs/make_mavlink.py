"""Write docs/mavlink.md: what a vehicle speaks, from the tables that it speaks by.

python docs/make_mavlink.py
"""

from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path

from markdown import KINDS, NONE, command, command_name, paragraph, table, vehicle

from mavherd.transport.mavlink import mav
from mavherd.vehicles.flight.modes import Mode
from mavherd.vehicles.flight.personality import PERSONALITIES, ModeTable
from mavherd.vehicles.missions.items import MissionType
from mavherd.vehicles.missions.supported import REFUSED, SUPPORTED, Effect, Supported
from mavherd.vehicles.protocol.commands import LINK_COMMANDS
from mavherd.vehicles.protocol.flight_commands import FLIGHT_COMMANDS
from mavherd.vehicles.protocol.rates import DATA_STREAMS, GROUPS
from mavherd.vehicles.protocol.telemetry import MESSAGES, name_of, note_of

PAGE = Path(__file__).parent / "mavlink.md"
STACKS = tuple(PERSONALITIES)
YES, PARTLY, KEPT = "yes", "partly", "kept"

_INTRODUCTION = """\
# What a vehicle speaks

Made by `make docs` from the tables that the code itself goes by; a test compares the two. How
things behave is told in [vehicles.md](vehicles.md). Parameters have [a page](parameters.md) of
their own.

*Yes*: as the flight stack does it. *Partly*: less than that, the remark says how. *Kept*: taken
and given back, without effect. Everything that is not listed is refused: commands with UNSUPPORTED,
mission items with MAV_MISSION_UNSUPPORTED, messages and modes as said below.

Personalities: `ardupilot` is ArduPilot 4.6 (the default), `px4` is PX4 1.16, `generic` is
MAV_AUTOPILOT_GENERIC with ArduPilot's modes and parameters."""

HEARD = {
    "COMMAND_INT": "every command, as above; places in 1e-7 degrees",
    "COMMAND_LONG": "every command, as above; places in degrees",
    "FILE_TRANSFER_PROTOCOL": "read-only: `@PARAM/param.pck`, component metadata; the rest: NAK",
    "HEARTBEAT": "of a ground station: kept in mind for the failsafe",
    "LOG_REQUEST_LIST": "there are none: LOG_ENTRY with num_logs 0",
    "MANUAL_CONTROL": "the sticks x, y, z and r; buttons do nothing",
    "MISSION_ACK": "an error calls the upload off",
    "MISSION_CLEAR_ALL": "one list or all; ERROR while the mission is flown",
    "MISSION_COUNT": "begins an upload",
    "MISSION_ITEM": "current 2: go there now; 3: change the height now; else as MISSION_ITEM_INT",
    "MISSION_ITEM_INT": "the item asked for; any other: INVALID_SEQUENCE",
    "MISSION_REQUEST": "answered with MISSION_ITEM",
    "MISSION_REQUEST_INT": "answered with MISSION_ITEM_INT",
    "MISSION_REQUEST_LIST": "answered with MISSION_COUNT",
    "MISSION_REQUEST_PARTIAL_LIST": "refused with UNSUPPORTED",
    "MISSION_SET_CURRENT": "answered with MISSION_CURRENT to everybody, and STATUSTEXT if not",
    "MISSION_WRITE_PARTIAL_LIST": "begins the upload of a part",
    "PARAM_REQUEST_LIST": "all, 20 every 10 ms; ardupilot introduces itself in STATUSTEXT, too",
    "PARAM_REQUEST_READ": "by name or by index; an unknown one: silence",
    "PARAM_SET": "echoed to everybody; refused: the old value, to the sender, and a STATUSTEXT",
    "PING": "answered when its target is 0",
    "RC_CHANNELS_OVERRIDE": "channels 1 to 4 are sticks; 5 to 18 are shown and switch nothing",
    "REQUEST_DATA_STREAM": "the groups below, on this link",
    "SET_ATTITUDE_TARGET": "in GUIDED: angles or body rates with a thrust",
    "SET_MODE": "with CUSTOM_MODE_ENABLED; ardupilot sends no ACK",
    "SET_POSITION_TARGET_GLOBAL_INT": "in GUIDED; see vehicles.md",
    "SET_POSITION_TARGET_LOCAL_NED": "in GUIDED; see vehicles.md",
    "TIMESYNC": "answered with nanoseconds since boot",
}
"""What comes of each message; the page cannot be made when one is missing here or too many."""

_PARTLY_HEARD = {
    "LOG_REQUEST_LIST",
    "MANUAL_CONTROL",
    "RC_CHANNELS_OVERRIDE",
    "SET_ATTITUDE_TARGET",
}
_REFUSED_HEARD = {"MISSION_REQUEST_PARTIAL_LIST"}

# What ground stations and scripts are known to try; neither list is complete.
_REFUSED_COMMANDS = (
    "NAV_WAYPOINT, DO_FOLLOW, DO_ORBIT, DO_SET_RELAY, DO_SET_SERVO, "
    "DO_MOTOR_TEST, DO_MOUNT_CONTROL, DO_DIGICAM_CONTROL, DO_SET_CAM_TRIGG_DIST, DO_PARACHUTE, "
    "DO_GRIPPER, DO_AUTOTUNE_ENABLE, DO_GUIDED_LIMITS, DO_AUX_FUNCTION, DO_SET_REVERSE, "
    "PREFLIGHT_CALIBRATION, PREFLIGHT_SET_SENSOR_OFFSETS, PREFLIGHT_STORAGE, OVERRIDE_GOTO, "
    "REQUEST_PROTOCOL_VERSION, REQUEST_CAMERA_INFORMATION, REQUEST_CAMERA_SETTINGS, "
    "REQUEST_STORAGE_INFORMATION, REQUEST_FLIGHT_INFORMATION, DO_GIMBAL_MANAGER_PITCHYAW, "
    "DO_GIMBAL_MANAGER_CONFIGURE, IMAGE_START_CAPTURE, VIDEO_START_CAPTURE, LOGGING_START, "
    "LOGGING_STOP, CONTROL_HIGH_LATENCY, DO_START_MAG_CAL, DO_CANCEL_MAG_CAL, DO_SEND_BANNER, "
    "BATTERY_RESET, GUIDED_CHANGE_SPEED, GUIDED_CHANGE_ALTITUDE, GUIDED_CHANGE_HEADING, "
    "SET_EKF_SOURCE_SET"
)
_IGNORED_MESSAGES = (
    "SET_GPS_GLOBAL_ORIGIN, SET_HOME_POSITION, AUTOPILOT_VERSION_REQUEST, "
    "CHANGE_OPERATOR_CONTROL, PARAM_MAP_RC, PARAM_EXT_REQUEST_LIST, PARAM_EXT_REQUEST_READ, "
    "PARAM_EXT_SET, LOG_REQUEST_DATA, LOG_ERASE, LOG_REQUEST_END, GPS_INJECT_DATA, GPS_RTCM_DATA, "
    "GPS_INPUT, VISION_POSITION_ESTIMATE, VISION_SPEED_ESTIMATE, VICON_POSITION_ESTIMATE, "
    "ATT_POS_MOCAP, OPTICAL_FLOW, DISTANCE_SENSOR, OBSTACLE_DISTANCE, ADSB_VEHICLE, "
    "LANDING_TARGET, TERRAIN_DATA, FENCE_POINT, FENCE_FETCH_POINT, RALLY_POINT, "
    "RALLY_FETCH_POINT, SET_ACTUATOR_CONTROL_TARGET, HIL_SENSOR, HIL_GPS, SERIAL_CONTROL, "
    "MOUNT_CONTROL, GIMBAL_MANAGER_SET_ATTITUDE, DIGICAM_CONTROL, PLAY_TUNE, SETUP_SIGNING, "
    "TUNNEL, V2_EXTENSION"
)


def page() -> str:
    """Return the whole page."""
    parts = [_INTRODUCTION]
    for title, section in (
        ("Modes", _modes()),
        ("Commands", _commands()),
        ("Mission, fence and rally items", _items()),
        ("Messages that a vehicle heeds", _heard()),
        ("Messages that a vehicle sends", _sent()),
        ("What AUTOPILOT_VERSION claims", _capabilities()),
    ):
        parts.append(f"## {title}\n\n{section}")
    return "\n\n".join(parts) + "\n"


def _modes() -> str:
    tables = {
        f"{stack} {KINDS[kind]}": modes
        for stack in ("ardupilot", "px4")
        for kind, modes in PERSONALITIES[stack].modes.items()
    }
    rows = [
        [mode.value, *(_mode(modes, mode) for modes in tables.values())]
        for mode in Mode
        if any(mode in modes.rows for modes in tables.values())
    ]
    parts = [
        "Name and `custom_mode`; of PX4, main mode and sub mode. `generic` has ArduPilot's. *Boot*:"
        " the vehicle begins there. *No arming*: arming is refused there.",
        table(("what it is", *tables), rows),
        "Refused by name, in a STATUSTEXT, with FAILED (px4: TEMPORARILY_REJECTED):",
        "\n".join(
            f"- {title}: " + ", ".join(f"{n} {_number(k)}" for k, n in modes.refused.items())
            for title, modes in tables.items()
        ),
        'Any other number: the same result, "No such mode" (px4: "Unsupported main mode").',
    ]
    return "\n\n".join(part if part.startswith("|") else _wrapped(part) for part in parts)


def _mode(modes: ModeTable, mode: Mode) -> str:
    if mode not in modes.rows:
        return NONE
    remarks = [f"{modes.name(mode)} {_number(modes.number(mode))}"]
    remarks += ["*boot*"] if mode is modes.boot else []
    remarks += ["*no arming*"] if mode in modes.not_armable else []
    return ", ".join(remarks)


def _number(custom_mode: int) -> str:
    if custom_mode < 1 << 16:
        return str(custom_mode)
    main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24
    return f"{main}/{sub}" if sub else str(main)


def _commands() -> str:
    flight = [(n, r.kinds, r.partly, r.note) for n, r in FLIGHT_COMMANDS.items()]
    link = [(n, tuple(KINDS), False, r.note) for n, r in LINK_COMMANDS.items()]
    rows = [
        (command(number), *_by_kind(kinds, PARTLY if partly else YES), note)
        for number, kinds, partly, note in sorted(flight + link)
    ]
    _refuse(command_name(number) for number, *_ in flight + link)
    return "\n\n".join(
        (
            "As COMMAND_LONG and as COMMAND_INT; the answer comes within 10 ms.",
            table(("MAV_CMD", *KINDS.values(), "how"), rows),
            _wrapped(f"UNSUPPORTED are all others, among them {_REFUSED_COMMANDS}."),
        )
    )


def _items() -> str:
    rows = []
    for _, rows_alike in groupby(SUPPORTED.values(), _says):
        alike = list(rows_alike)
        item = alike[0]
        names = ", ".join(command(each.command) for each in alike)
        status = KEPT if item.effect is Effect.NONE else PARTLY if item.partly else YES
        where = MissionType(item.mission_type).name.lower()
        rows.append((names, where, *_by_kind(item.kinds, status), item.note))
    refused = [(command(number), why) for number, why in REFUSED.items()]
    return "\n\n".join(
        (
            table(("item", "list", *KINDS.values(), "how"), rows),
            "Refused like every other one, with MAV_MISSION_UNSUPPORTED, and why:",
            table(("item", "why"), refused),
        )
    )


def _says(item: Supported) -> tuple[object, ...]:
    return item.note, item.kinds, item.effect, item.mission_type


def _heard() -> str:
    heeds = {stack: vehicle("quadcopter", stack).converse().heeds for stack in STACKS}
    everything = frozenset().union(*heeds.values())
    if everything != set(HEARD):
        raise ValueError(f"HEARD is not up to date: {sorted(everything ^ set(HEARD))}")
    rows = []
    for name, how in HEARD.items():
        stacks = [stack for stack in STACKS if name in heeds[stack]]
        only = "" if len(stacks) == len(STACKS) else f"{' and '.join(stacks)} only: "
        status = "refused" if name in _REFUSED_HEARD else PARTLY if name in _PARTLY_HEARD else YES
        rows.append((name, status, only + how))
    _refuse(everything)
    return "\n\n".join(
        (
            table(("message", "", "what comes of it"), rows),
            _wrapped(f"All others are ignored, among them {_IGNORED_MESSAGES}."),
        )
    )


def _sent() -> str:
    vehicles = {stack: vehicle("quadcopter", stack) for stack in STACKS}
    streams = {stack: v.converse(spoken=True).streams for stack, v in vehicles.items()}
    rows = []
    for number in sorted(frozenset().union(*(v.telemetry.ids for v in vehicles.values()))):
        rates = []
        for stack, v in vehicles.items():
            interval_us = streams[stack].interval_us(number)
            hz = f"{1e6 / interval_us:g}" if interval_us > 0 else "asked"
            rates.append(hz if number in v.telemetry.ids else NONE)
        row = MESSAGES.get(number)
        status = PARTLY if row and row.partly else YES
        rows.append((f"{name_of(number)} ({number})", status, *rates, note_of(number)))
    text = (
        "In Hz, how often it is sent unasked on a link that has spoken, each link on its own;"
        " *asked*: only when asked for. With SET_MESSAGE_INTERVAL at any rate up to 100 Hz, once"
        " with REQUEST_MESSAGE. *Partly*: fields are constant or left out. All come from the"
        " physics, without noise. Besides: STATUSTEXT, MISSION_ITEM_REACHED, and answers."
    )
    groups = [
        (_stream(number), f"`SRn_{group}`", ", ".join(map(name_of, GROUPS[group])) or "none")
        for number, (group, *_) in DATA_STREAMS.items()
        if number != mav.MAV_DATA_STREAM_ALL
    ]
    return "\n\n".join(
        (
            _wrapped(text),
            table(("message", "", *STACKS, "remark"), rows),
            _wrapped(
                "REQUEST_DATA_STREAM (and ArduPilot's parameters SR0_ to SR3_, for the first link"
                " to the fourth) set these groups:"
            ),
            table(("MAV_DATA_STREAM", "parameter", "messages"), groups),
        )
    )


def _stream(number: int) -> str:
    name = str(mav.enums["MAV_DATA_STREAM"][number].name).removeprefix("MAV_DATA_STREAM_")
    return f"{name} ({number})"


def _capabilities() -> str:
    claims = {}
    for stack in STACKS:
        version = vehicle("quadcopter", stack).telemetry.make(mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        claims[stack] = version.capabilities if version else 0
    rows = [
        (
            str(bit.name).removeprefix("MAV_PROTOCOL_CAPABILITY_"),
            *(YES if claim & number else NONE for claim in claims.values()),
        )
        for number, bit in mav.enums["MAV_PROTOCOL_CAPABILITY"].items()
        if bit.name != "MAV_PROTOCOL_CAPABILITY_ENUM_END"
        and any(claim & number for claim in claims.values())
    ]
    return table(("capability", *STACKS), rows)


def _refuse(served: Iterable[str]) -> None:
    """Raise ValueError when one of these is said to be refused or ignored."""
    refused = f"{_REFUSED_COMMANDS}, {_IGNORED_MESSAGES}".split(", ")
    if wrong := set(refused).intersection(served):
        raise ValueError(f"no longer refused: {sorted(wrong)}")


def _by_kind(kinds: Iterable[str], status: str) -> Iterator[str]:
    return (status if kind in kinds else NONE for kind in KINDS)


def _wrapped(text: str) -> str:
    return "\n".join(map(paragraph, text.splitlines()))


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
