"""One outside vehicle: what it tells, dated by its own clock, until somebody records it."""

from collections.abc import Callable
from math import hypot, inf, isfinite, radians
from typing import Any, NamedTuple

from ....transport.frames import (
    Quaternion,
    Triple,
    quaternion_from_euler,
    quaternion_to_enu,
    swap_ned_enu,
)
from ....transport.mavlink import Message, mav
from ...station.status import VehicleStatus
from .clock import VehicleClock
from .kinds import describe, kind_of, mode_of
from .place import OwnFrame, Spot, local_spot
from .series import Series

SILENT_S = 3.0  # without a word: the link is said to be silent
_LOCAL_FIRST_S = 2.0  # so long its metres count more than its degrees
_NO_POSITION, _NO_VELOCITY = 0x007, 0x038  # bits of a type_mask
_NO_HEADING, _NO_SIGNAL = 65535, 255
_INFO: int = mav.MAV_SEVERITY_INFO
_NOTICE: int = mav.MAV_SEVERITY_NOTICE
_WARNING: int = mav.MAV_SEVERITY_WARNING


class Value(NamedTuple):
    """A number for a plot, as MAVLink tells it."""

    plot: str
    time: float
    numbers: tuple[float, ...]


class Wanted(NamedTuple):
    """Where a vehicle is to go, and how fast (NED)."""

    time: float
    spot: Spot | None
    velocity: Triple | None


class SeenVehicle:
    """What one vehicle has told and nobody has recorded yet.

    All times are seconds of the recording. Whoever records what is in a list empties it.
    """

    def __init__(self, system_id: int, heartbeat: Message, source: str, now: float) -> None:
        self.name = f"sys{system_id}"
        self.system_id = system_id
        self.source = source  # where it is heard
        self.mav_type, self.autopilot = heartbeat.type, heartbeat.autopilot
        self.kind = kind_of(heartbeat.type)
        self.frame = OwnFrame()
        self.spots: list[tuple[float, Spot]] = []
        self.velocities = Series(3)  # ENU
        self.attitudes = Series(4)  # w x y z, FLU to ENU
        self.rates = Series(3)  # FLU
        self.servos = Series(4)  # of outputs 1 to 4 as shares, 0..1, of their way; 0: disarmed
        self.wanted: list[Wanted] = []
        self.values: list[Value] = []
        self.events: list[dict[str, Any]] = []
        self.modes: list[tuple[float, str]] = []
        self.first_at = self.heard_at = now
        self.heard = 0  # messages
        self._clock = VehicleClock()
        self._status = VehicleStatus()
        self._now = now  # the moment of the message that is being heard
        self._silent = False
        self._local_at = -inf
        self._told_target_at = -inf
        self._hear: dict[str, Callable[[Message], None]] = {
            "HEARTBEAT": self._on_heartbeat,
            "LOCAL_POSITION_NED": self._on_local,
            "GLOBAL_POSITION_INT": self._on_global,
            "ATTITUDE": self._on_attitude,
            "ATTITUDE_QUATERNION": self._on_quaternion,
            "GPS_GLOBAL_ORIGIN": self._on_origin,
            "POSITION_TARGET_LOCAL_NED": self._on_target,
            "POSITION_TARGET_GLOBAL_INT": self._on_target,
            "SERVO_OUTPUT_RAW": self._on_servos,
            "SYS_STATUS": self._on_power,
            "BATTERY_STATUS": self._on_power,
            "VFR_HUD": self._on_hud,
            "RC_CHANNELS": self._on_radio,
        }
        what = describe(self.mav_type, self.autopilot)
        self._say("link", f"{what}, system {system_id}, heard at {source}", _NOTICE)

    @property
    def reboots(self) -> int:
        """Return how often its clock has begun anew."""
        return self._clock.reboots

    @property
    def moves_at(self) -> float:
        """Return when it last told a position or an attitude; -inf: never."""
        return max(self.attitudes.newest, self.velocities.newest)

    def hear(self, m: Message, now: float) -> None:
        """Take in a message of its autopilot that arrives at `now`."""
        if self._silent:
            self._silent = False
            self._say_at(now, "link", f"link back after {now - self.heard_at:.1f} s", _NOTICE)
        self.heard_at = now
        self.heard += 1
        boot_ms = getattr(m, "time_boot_ms", 0)
        self._now = now
        if boot_ms:
            reboots = self._clock.reboots
            self._now = self._clock.hear(boot_ms * 1e-3, now)
            if self._clock.reboots != reboots:
                self.frame = OwnFrame()
                self._say("problem", "its clock has begun anew: it has rebooted", _WARNING)
        if text := self._status.hear(m, now):
            self._say("text", text[2], text[1])
        if handler := self._hear.get(m.get_type()):
            handler(m)

    def hear_order(self, m: Message, now: float) -> None:
        """Take in a target that somebody else has sent to it; what it tells itself counts more."""
        if now - self._told_target_at > SILENT_S:
            self._now = now
            self._want(m)

    def watch(self, now: float) -> None:
        """Note that nothing more has arrived until `now`."""
        if not self._silent and now - self.heard_at > SILENT_S:
            self._silent = True
            self._say_at(self.heard_at + SILENT_S, "link", "link silent", _WARNING)

    def _on_heartbeat(self, m: Message) -> None:
        armed = bool(m.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)
        mode = mode_of(self.mav_type, self.autopilot, m.custom_mode)
        self.modes.append((self._now, mode if armed else f"{mode} disarmed"))
        if not armed:
            self.servos.add(self._now, (0.0, 0.0, 0.0, 0.0))

    def _on_local(self, m: Message) -> None:
        velocity = (m.vx, m.vy, m.vz)
        spot = local_spot(m)
        if spot is None or spot.local is None or not all(map(isfinite, velocity)):
            return
        self._local_at = self._now
        self.frame.hear_local(spot.local, hypot(m.vx, m.vy), self._now)
        self.spots.append((self._now, spot))
        self.velocities.add(self._now, swap_ned_enu(velocity))

    def _on_global(self, m: Message) -> None:
        spot = self.frame.hear_global(m, self._now)
        if spot is None:
            return
        if self._now - self._local_at > _LOCAL_FIRST_S:
            self.spots.append((self._now, spot))
            velocity = (m.vx * 1e-2, m.vy * 1e-2, m.vz * 1e-2)
            self.velocities.add(self._now, swap_ned_enu(velocity))
        if m.hdg != _NO_HEADING and self._now - self.attitudes.newest > _LOCAL_FIRST_S:
            self._turn(quaternion_from_euler(0.0, 0.0, radians(m.hdg * 1e-2)))

    def _on_attitude(self, m: Message) -> None:
        if isfinite(m.roll + m.pitch + m.yaw):
            self._turn(quaternion_from_euler(m.roll, m.pitch, m.yaw))
            self._rotate(m)

    def _on_quaternion(self, m: Message) -> None:
        if isfinite(m.q1 + m.q2 + m.q3 + m.q4) and any((m.q1, m.q2, m.q3, m.q4)):
            self._turn((m.q1, m.q2, m.q3, m.q4))
            self._rotate(m)

    def _turn(self, q: Quaternion) -> None:
        """Keep an attitude (FRD to NED), with the sign that is nearer to the one before."""
        q = quaternion_to_enu(q)
        before = self.attitudes.last
        if before and sum(a * b for a, b in zip(before, q, strict=True)) < 0:
            q = (-q[0], -q[1], -q[2], -q[3])
        self.attitudes.add(self._now, q)

    def _rotate(self, m: Message) -> None:
        rates = (m.rollspeed, -m.pitchspeed, -m.yawspeed)
        if all(map(isfinite, rates)):
            self.rates.add(self._now, rates)

    def _on_origin(self, m: Message) -> None:
        self.frame.hear_origin(m)

    def _on_target(self, m: Message) -> None:
        self._told_target_at = self._now
        self._want(m)

    def _want(self, m: Message) -> None:
        spot = None if m.type_mask & _NO_POSITION else self.frame.target_spot(m)
        velocity: Triple | None = None
        if not m.type_mask & _NO_VELOCITY and isfinite(m.vx + m.vy + m.vz):
            velocity = (m.vx, m.vy, m.vz)
        if spot or velocity:
            self.wanted.append(Wanted(self._now, spot, velocity))

    def _on_servos(self, m: Message) -> None:
        if m.port:
            return
        pulses = (m.servo1_raw, m.servo2_raw, m.servo3_raw, m.servo4_raw)
        self.values.append(Value("servos", self._now, tuple(map(float, pulses))))
        if self._status.armed:
            one, two, three, four = (min(1.0, max(0.0, us * 1e-3 - 1.0)) for us in pulses)
            self.servos.add(self._now, (one, two, three, four))

    def _on_power(self, _: Message) -> None:
        if (volts := self._status.battery_v) is not None:
            self.values.append(Value("battery", self._now, (volts,)))
        if (share := self._status.battery_remaining) is not None:
            self.values.append(Value("charge", self._now, (share * 100,)))

    def _on_hud(self, m: Message) -> None:
        self.values.append(Value("throttle", self._now, (float(m.throttle),)))

    def _on_radio(self, m: Message) -> None:
        if m.rssi != _NO_SIGNAL:
            self.values.append(Value("signal", self._now, (m.rssi / 2.54,)))

    def _say(self, kind: str, text: str, severity: int) -> None:
        self._say_at(self._now, kind, text, severity)

    def _say_at(self, now: float, kind: str, text: str, severity: int) -> None:
        event = {"t": now, "vehicle": self.name, "kind": kind, "text": text, "severity": severity}
        self.events.append(event)
