"""Everything one vehicle process needs to know; travels as JSON from launcher to vehicle."""

import json
from dataclasses import asdict, dataclass, field
from typing import Any

from ..transport.frames import Origin

SLICE_US = 10_000
"""Links, telemetry and state machine are looked at every 10 ms: no stream exceeds 100 Hz."""

KINDS = ("quadcopter", "rover")
PROFILES = ("default", "paper", "ardupilot")
AUTOPILOTS = ("ardupilot", "px4", "generic")
DISTURBANCE_FORMS = ("off", "held", "white", "constant")
MAX_SYSTEM_ID = 240

SIMULATED_EPOCH_US = 1_767_225_600_000_000
"""2026-01-01T00:00:00Z: SYSTEM_TIME in a scenario is this plus simulated time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Disturbance:
    """A random force along the body axes (paper section 6.1), drawn from the vehicle's own seed."""

    form: str = "off"  # off, held (new value every `hold_s`), white (every step), constant
    amplitude: float = 0.4  # N, uniform in +-amplitude on each axis
    hold_s: float = 0.1

    def __post_init__(self) -> None:
        if self.form not in DISTURBANCE_FORMS:
            raise ValueError(f"form must be one of {', '.join(DISTURBANCE_FORMS)}")
        if not 0 <= self.amplitude <= 1000:
            raise ValueError(f"amplitude must be 0..1000 N, got {self.amplitude}")
        if not self.hold_s > 0:
            raise ValueError(f"hold_s must be positive, got {self.hold_s}")


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleConfig:
    """One vehicle: identity, where it starts (local NED), parameters and seeded randomness."""

    kind: str
    system_id: int
    name: str = ""
    origin: Origin = Origin()
    north: float = 0.0  # m from the fleet origin
    east: float = 0.0
    down: float = 0.0  # m; the ground below this vehicle is here
    yaw: float = 0.0  # rad, clockwise from north
    autopilot: str = "ardupilot"  # the flight stack that clients take it for
    profile: str = "default"
    params: dict[str, float] = field(default_factory=dict)  # overrides, by parameter name
    disturbance: Disturbance = Disturbance()
    seed: int = 0  # of the scenario; combined with the system id
    latch_position: bool = True  # a position target outlives the time-out, as on ArduPilot
    epoch_us: int = SIMULATED_EPOCH_US  # UTC at boot, for SYSTEM_TIME and GPS time

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"kind must be one of {', '.join(KINDS)}, got {self.kind!r}")
        if not 1 <= self.system_id <= MAX_SYSTEM_ID:
            raise ValueError(f"system_id must be 1..{MAX_SYSTEM_ID}, got {self.system_id}")
        if self.autopilot not in AUTOPILOTS:
            raise ValueError(
                f"autopilot must be one of {', '.join(AUTOPILOTS)}, got {self.autopilot!r}"
            )
        if self.profile not in PROFILES:
            raise ValueError(f"profile must be one of {', '.join(PROFILES)}, got {self.profile!r}")

    def to_json(self) -> str:
        """Return this configuration as one line of JSON."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> "VehicleConfig":
        """Return the configuration in `text`, the inverse of `to_json`."""
        data: dict[str, Any] = json.loads(text)
        data["origin"] = Origin(**data["origin"])
        data["disturbance"] = Disturbance(**data["disturbance"])
        return cls(**data)
