"""What the columns of a run's tables are: name, unit, frame, meaning. docs/data.md has the same.

The version counts up when a column changes its name, unit or meaning; new ones do not matter.
"""

from typing import NamedTuple

VERSION = 1

LOCAL = "ENU from the fleet origin"
TURN = "body FLU to ENU"
BODY = "body FLU"


class Column(NamedTuple):
    """One column. `unit` is 1 where there is none; `frame` is empty where none matters."""

    name: str
    unit: str
    frame: str
    text: str
    kind: str = "float64"  # | text | int16


STATES = (
    Column("robot", "1", "", "its name", "text"),
    Column("kind", "1", "", "`rover` or `quadcopter`", "text"),
    Column("system_id", "1", "", "its MAVLink system id", "int16"),
    Column("time_s", "s", "", "fleet time; 0 is the start of the run"),
    Column("east_m", "m", LOCAL, "position"),
    Column("north_m", "m", LOCAL, "position"),
    Column("up_m", "m", LOCAL, "position; a rover's is 0, on the ground"),
    Column("v_east_m_s", "m/s", LOCAL, "velocity"),
    Column("v_north_m_s", "m/s", LOCAL, "velocity"),
    Column("v_up_m_s", "m/s", LOCAL, "velocity"),
    Column("qw", "1", TURN, "attitude, a unit quaternion"),
    Column("qx", "1", TURN, "attitude"),
    Column("qy", "1", TURN, "attitude"),
    Column("qz", "1", TURN, "attitude"),
    Column("roll_rate_rad_s", "rad/s", BODY, "turn rate about the axis ahead"),
    Column("pitch_rate_rad_s", "rad/s", BODY, "turn rate about the axis to the left"),
    Column("yaw_rate_rad_s", "rad/s", BODY, "turn rate about the axis up"),
)
"""Of states.parquet, for every robot."""

EVENTS = (
    Column("time_s", "s", "", "fleet time"),
    Column("vehicle", "1", "", "whom it is about; null: the team, or the run", "text"),
    Column("kind", "1", "", "`phase`, `text` (a STATUSTEXT), `link`, `problem`, ...", "text"),
    Column("severity", "1", "", "MAVLink's: 0 emergency to 7 debug; null: none was given", "int16"),
    Column("text", "1", "", "what happened", "text"),
)
"""Of events.parquet."""

ROVERS = (
    *(
        Column(f"{side}_wheel_{what}_rad_s", "rad/s", "", f"{side} wheel, {text}")
        for what, text in (("speed", "as it turns"), ("command", "as commanded"))
        for side in ("left", "right")
    ),
    Column("speed_command_m_s", "m/s", BODY, "speed ahead that the controller was asked for"),
    Column("yaw_rate_command_rad_s", "rad/s", BODY, "turn rate that it was asked for"),
)
"""What only rovers have; null for quadcopters."""

QUADCOPTERS = (
    *(
        Column(f"rotor{k}_{what}_rad_s", "rad/s", "", f"rotor {k}, {text}")
        for what, text in (("speed", "as it turns"), ("command", "as commanded"))
        for k in range(1, 5)
    ),
    Column("roll_command_rad", "rad", TURN, "roll that the controller asked for"),
    Column("pitch_command_rad", "rad", TURN, "pitch that it asked for"),
    Column("yaw_command_rad", "rad", TURN, "yaw that it asked for, from east"),
    Column("thrust_command_n", "N", "", "thrust of all rotors that it asked for"),
)
"""What only quadcopters have; null for rovers."""

_BY_NAME = {column.name: column for column in (*STATES, *ROVERS, *QUADCOPTERS)}
_UNITS = {"_rad_s": "rad/s", "_m_s2": "m/s^2", "_m_s": "m/s", "_rad": "rad", "_m": "m", "_s": "s"}


def describe(name: str) -> Column:
    """Return what a column of states.parquet is; of an unknown one, what its name says."""
    unit = next((unit for suffix, unit in _UNITS.items() if name.endswith(suffix)), "1")
    return _BY_NAME.get(name, Column(name, unit, "", ""))
