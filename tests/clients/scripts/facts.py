"""What every client script needs: to tell what it has seen, and to measure places."""

import json
import time
from math import cos, hypot, radians
from pathlib import Path

METRES_PER_DEGREE = 111_319.5  # of latitude; what ArduPilot uses
_STARTED = time.monotonic()


def fact(**facts: object) -> None:
    """Write one line of JSON for the test that has started this script.

    Not to where clients log: their threads and processes write there whenever they like.
    """
    line = json.dumps({**facts, "at_s": round(time.monotonic() - _STARTED, 1)})
    with Path("facts.jsonl").open("a") as file:
        file.write(line + "\n")


def offset(lat: float, lon: float, north: float, east: float) -> tuple[float, float]:
    """Return the place so many metres north and east of another, in degrees."""
    return (
        lat + north / METRES_PER_DEGREE,
        lon + east / METRES_PER_DEGREE / cos(radians(lat)),
    )


def distance(a: tuple[float, float], b: tuple[float, float]) -> float:
    """Return the metres between two places given in degrees."""
    north = (b[0] - a[0]) * METRES_PER_DEGREE
    east = (b[1] - a[1]) * METRES_PER_DEGREE * cos(radians(a[0]))
    return hypot(north, east)
