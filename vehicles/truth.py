"""The truth log: what the physics has, at 100 Hz, as one JSON header line and raw float64 rows.

Beside it stands the motion that the onboard controllers ask for: NaN while they ask for none.
Of a run that is not kept only the places are, in memory: what a judge needs.
"""

import json
import struct
from pathlib import Path

from .config import VehicleConfig
from .robot import Robot

RATE_HZ = 100
SCHEMA = 1
POSE_COLUMNS = (
    "time_s",
    "north_m",
    "east_m",
    "down_m",
    "v_north_m_s",
    "v_east_m_s",
    "v_down_m_s",
    "qw",  # attitude, body FRD to local NED
    "qx",
    "qy",
    "qz",
    "roll_rate_rad_s",
    "pitch_rate_rad_s",
    "yaw_rate_rad_s",
)


_PLACE = struct.Struct("<4d")


class TruthLog:
    """Writes `truth.bin.part` and renames it to `truth.bin` when it is complete."""

    def __init__(self, folder: Path, config: VehicleConfig, robot: Robot) -> None:
        columns = POSE_COLUMNS + robot.actuator_names + robot.command_names
        header = {
            "schema": SCHEMA,
            "name": config.name,
            "kind": config.kind,
            "system_id": config.system_id,
            "rate_hz": RATE_HZ,
            "columns": columns,
            "commands": len(robot.command_names),  # of the columns: the last ones
        }
        self._path = folder / "truth.bin"
        self._part = folder / "truth.bin.part"
        self._file = self._part.open("wb", buffering=1 << 14)
        self._file.write(json.dumps(header).encode() + b"\n")
        self._pack = struct.Struct(f"<{len(columns)}d").pack

    def write(self, now: float, robot: Robot) -> None:
        """Append one row."""
        row = self._pack(now, *robot.kinematics(), *robot.actuators(), *robot.commands())
        self._file.write(row)

    def flush(self) -> None:
        """Let readers see what was written so far."""
        self._file.flush()

    def close(self) -> None:
        """Finish the file under its final name."""
        self._file.close()
        self._part.rename(self._path)


class PlaceLog:
    """Keeps where a robot was: `rows` of time, north, east and down as float64."""

    def __init__(self) -> None:
        self.rows = bytearray()

    def write(self, now: float, robot: Robot) -> None:
        """Append one row."""
        north, east, down = robot.place()
        self.rows += _PLACE.pack(now, north, east, down)
