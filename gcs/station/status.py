"""What a vehicle last said of itself."""

from collections import deque
from dataclasses import dataclass, field
from math import isfinite

from ...transport.frames import Origin, Quaternion, Triple, quaternion_from_euler
from ...transport.mavlink import Message, mav
from ...vehicles.flight.modes import Mode
from ...vehicles.flight.personality import PX4

Text = tuple[float, int, str]
"""Fleet time, severity and text of a STATUSTEXT."""
Texts = deque[Text]
KEPT_TEXTS = 32

_TELLS_TIME = ("LOCAL_POSITION_NED", "ATTITUDE", "GLOBAL_POSITION_INT", "SYSTEM_TIME")
_REORDERED_S = 1.0  # a clock that goes back further has begun anew
_CHUNK = 50  # characters in a STATUSTEXT; a shorter one is the last
_QUOTED = 3  # texts in an error
_PREARM: int = mav.MAV_SYS_STATUS_PREARM_CHECK
_OFFBOARD = PX4.modes["quadcopter"].number(Mode.GUIDED)
_LANDED = {
    mav.MAV_LANDED_STATE_ON_GROUND: True,
    mav.MAV_LANDED_STATE_IN_AIR: False,
    mav.MAV_LANDED_STATE_TAKEOFF: False,
    mav.MAV_LANDED_STATE_LANDING: False,
}


def said_since(texts: Texts, since: float, least: int = mav.MAV_SEVERITY_WARNING) -> str:
    """Return what a vehicle has said since then, as the end of a sentence; "" nothing.

    Texts of less than the `least` severity (a higher number) are of something else.
    """
    said = list(dict.fromkeys(t for at, how, t in texts if at >= since and t and how <= least))
    return f": the vehicle says {', '.join(map(repr, said[-_QUOTED:]))}" if said else ""


@dataclass(slots=True)
class VehicleStatus:
    """What the vehicle last said of itself (NED, SI); times are fleet time of arrival, -1: never.

    `position` and `velocity` are in the fleet's frame. None says that it has not told. `boots`
    counts how often its own clock went back.
    """

    heard_at: float = -1.0  # anything
    heartbeat_at: float = -1.0
    position_at: float = -1.0
    position: Triple = (0.0, 0.0, 0.0)
    velocity: Triple = (0.0, 0.0, 0.0)
    quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)
    yaw: float = 0.0
    armed: bool = False
    custom_mode: int = 0
    changed_after: float = -1.0  # the last heartbeat before mode or arming changed
    mav_type: int | None = None
    autopilot: int | None = None
    boot_s: float = -1.0  # its own seconds since boot
    boots: int = 0
    landed: bool | None = None
    gps_fix: int | None = None  # GPS_FIX_TYPE; 3 and more is a position
    satellites: int | None = None
    battery_remaining: float | None = None  # 0..1
    battery_v: float | None = None
    sensors: tuple[int, int, int] | None = None  # present, enabled, healthy
    prearm_ok: bool | None = None  # whether it would arm
    home: tuple[float, float, float] | None = None  # latitude, longitude (deg), altitude (m)
    origin: Origin | None = None  # of its own local frame
    global_position: tuple[float, float, float] | None = None  # as home
    global_position_at: float = -1.0
    version: tuple[int, int, int] | None = None  # of its firmware
    texts: Texts = field(default_factory=lambda: deque(maxlen=KEPT_TEXTS))
    _chunks: dict[int, str] = field(default_factory=dict)

    def hear(self, m: Message, now: float) -> Text | None:
        """Take in a message of the vehicle; return the STATUSTEXT that it completes, if any."""
        self.heard_at = now
        name = m.get_type()
        if name in _TELLS_TIME:
            self._on_time(m.time_boot_ms * 1e-3)
        if name == "LOCAL_POSITION_NED":
            return None  # most of what comes; where it is in the fleet's frame, the station knows
        match name:
            case "ATTITUDE" if isfinite(m.roll + m.pitch + m.yaw):
                self.quaternion = quaternion_from_euler(m.roll, m.pitch, m.yaw)
                self.yaw = m.yaw
            case "HEARTBEAT":
                armed = bool(m.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)
                if (armed, m.custom_mode) != (self.armed, self.custom_mode):
                    self.changed_after = self.heartbeat_at
                self.heartbeat_at, self.armed = now, armed
                if self.landed is False and not self.armed:
                    self.landed = True  # EXTENDED_SYS_STATE says so up to a second later
                self.custom_mode = m.custom_mode
                self.mav_type, self.autopilot = m.type, m.autopilot
            case "STATUSTEXT":
                return self._on_text(m, now)
            case "SYS_STATUS":
                self._on_sys_status(m)
            case "BATTERY_STATUS":
                self._on_battery(m)
            case "GPS_RAW_INT":
                self.gps_fix = m.fix_type
                self.satellites = None if m.satellites_visible == 255 else m.satellites_visible
            case "EXTENDED_SYS_STATE":
                self.landed = _LANDED.get(m.landed_state)
            case "GLOBAL_POSITION_INT":
                self.global_position = _place(m.lat, m.lon, m.alt)
                self.global_position_at = now
            case "HOME_POSITION":
                self.home = _place(m.latitude, m.longitude, m.altitude)
            case "GPS_GLOBAL_ORIGIN":
                self.origin = _origin(m) or self.origin
            case "AUTOPILOT_VERSION":
                v = m.flight_sw_version
                self.version = (v >> 24 & 255, v >> 16 & 255, v >> 8 & 255)
        return None

    def forget(self) -> None:
        """Forget what a reboot has made untrue; its HEARTBEAT tells the rest anew."""
        self.position_at = self.global_position_at = -1.0
        self.origin = self.home = self.global_position = None
        self.gps_fix = self.satellites = self.landed = None
        self.sensors = self.prearm_ok = self.battery_remaining = self.battery_v = None

    def _on_time(self, boot_s: float) -> None:
        if boot_s < self.boot_s - _REORDERED_S:
            self.boots += 1
            self.boot_s = boot_s
        elif boot_s > self.boot_s:
            self.boot_s = boot_s

    def _on_text(self, m: Message, now: float) -> Text | None:
        """Join the chunks of a long text; PX4 ends its own with a tab.

        What a terminal might take for an order becomes a space.
        """
        text: str = m.text
        if m.id:
            if len(self._chunks) > KEPT_TEXTS:
                self._chunks.clear()  # beginnings whose ends were lost
            before = self._chunks.pop(m.id, "") if m.chunk_seq else ""
            text = before + text
            if len(m.text) == _CHUNK:
                self._chunks[m.id] = text
                return None
        text = "".join(c if c.isprintable() else " " for c in text).strip()
        whole = (now, m.severity, text)
        self.texts.append(whole)
        return whole

    def _on_sys_status(self, m: Message) -> None:
        present = m.onboard_control_sensors_present
        enabled, health = m.onboard_control_sensors_enabled, m.onboard_control_sensors_health
        self.sensors = (present, enabled, health)
        healthy = bool(health & _PREARM)
        told = bool(enabled & _PREARM)  # ArduPilot: whether it checks at all
        if self.autopilot == mav.MAV_AUTOPILOT_PX4:  # it sets the bit in `health` only,
            # and in OFFBOARD, which a flight before may have left it in, not without a stream
            told = healthy or self.custom_mode != _OFFBOARD
        self.prearm_ok = healthy if told else None
        if m.voltage_battery not in (0, 0xFFFF):
            self.battery_v = m.voltage_battery * 1e-3
        if m.battery_remaining >= 0:
            self.battery_remaining = m.battery_remaining * 1e-2

    def _on_battery(self, m: Message) -> None:
        if m.id != 0:
            return  # the first counts
        cells = [v for v in m.voltages if v != 0xFFFF]
        if any(cells):
            self.battery_v = sum(cells) * 1e-3
        if m.battery_remaining >= 0:
            self.battery_remaining = m.battery_remaining * 1e-2


def _place(lat_e7: int, lon_e7: int, alt_mm: int) -> tuple[float, float, float] | None:
    """Return degrees and metres; None for the place 0, 0, which says "not known"."""
    return (lat_e7 * 1e-7, lon_e7 * 1e-7, alt_mm * 1e-3) if lat_e7 or lon_e7 else None


def _origin(m: Message) -> Origin | None:
    if _place(m.latitude, m.longitude, 0) is None:
        return None
    try:
        return Origin(m.latitude * 1e-7, m.longitude * 1e-7, m.altitude * 1e-3)
    except ValueError:  # a place that cannot be one
        return None
