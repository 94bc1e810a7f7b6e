"""The flight and drive state machine: arming, modes, takeoff, landing, setpoints. No I/O, no clock.

MAVLink commands reach it through `commands.py`; what it wants flown comes out as `setpoint`.
"""

from math import hypot

from ...transport.frames import yaw_of
from ...transport.mavlink import Message, mav
from ..config import VehicleConfig
from .modes import AUTOPILOT, IDENTITIES, Mode
from .position_target import Here, IllegalTarget, PositionTarget, parse
from ..robot import Robot, Setpoint, Vec3

DISARM_DELAY = 10.0  # s on the ground, armed, without a takeoff (ArduPilot's DISARM_DELAY)
RTL_ALTITUDE = 15.0  # m above home (ArduPilot's RTL_ALT)
LAND_SPEED = 0.5  # m/s (ArduPilot's LAND_SPEED)
LAND_SPEED_HIGH = 1.0  # m/s above LAND_SLOW_BELOW
LAND_SLOW_BELOW = 5.0  # m above home
_SETTLED = 0.3  # s on the ground before motors stop
_CLOSE = 0.2  # m: a takeoff or a leg home has arrived
_TEXT_INTERVAL = 1.0  # s between equal STATUSTEXTs
_MAX_TOPICS = 32  # different STATUSTEXTs within that time
_UPDATE = 0.01  # s between two calls of `update`
_NEVER = float("inf")
_POSITION_ONLY = 0xDF8  # type_mask
_HIGHEST = 10_000.0  # m, of a takeoff
_LAND_LEAD = 0.5  # m that a landing's reference may be below the vehicle

_HOLD = Setpoint()
ACCEPTED: int = mav.MAV_RESULT_ACCEPTED
DENIED: int = mav.MAV_RESULT_DENIED
FAILED: int = mav.MAV_RESULT_FAILED


class Autopilot:
    """Decides what one robot does. `update` is called every 10 ms with seconds since boot."""

    def __init__(self, config: VehicleConfig, robot: Robot) -> None:
        self.config = config
        self.identity = IDENTITIES[config.kind]
        self.flies = config.kind == "quadcopter"
        self.mode = self.identity.boot_mode
        self.armed = False
        self.now = 0.0
        self.home = Vec3(config.north, config.east, config.down)
        self.home_yaw = config.yaw
        self.target: PositionTarget | None = None
        self.setpoint = _HOLD
        self.broadcasts: list[Message] = []  # for every link; the shell takes them
        self._robot = robot
        self._takeoff: Vec3 | None = None
        self._has_flown = False
        self._landed_since = 0.0  # when it last came to stand on the ground
        self._target_at = 0.0
        self._return_at: Vec3 | None = None  # where to climb to before flying home
        self._land_at: Vec3 | None = None  # the point that a landing lets down
        self._texts: dict[str, float] = {}

    # What others read

    @property
    def in_air(self) -> bool:
        """Whether the vehicle has left the ground."""
        return self.flies and not self._robot.on_ground

    @property
    def landed_state(self) -> int:
        """Return MAV_LANDED_STATE."""
        if not self.in_air:
            return int(mav.MAV_LANDED_STATE_ON_GROUND)
        if self._takeoff is not None:
            return int(mav.MAV_LANDED_STATE_TAKEOFF)
        if self.mode is Mode.LAND:
            return int(mav.MAV_LANDED_STATE_LANDING)
        return int(mav.MAV_LANDED_STATE_IN_AIR)

    def arming_refusal(self) -> str | None:
        """Return why the vehicle cannot be armed now, None when it can."""
        if self.mode is Mode.RTL:
            return "RTL mode not armable"
        if self.in_air:
            return "in the air"
        return None

    # What commands do; each returns a MAV_RESULT

    def arm(self) -> int:
        """Arm, or say why not."""
        if self.armed:
            return ACCEPTED
        if reason := self.arming_refusal():
            self.say(f"Arm: {reason}", mav.MAV_SEVERITY_CRITICAL)
            return FAILED
        self.armed = True
        self._robot.motors_on = not self.flies  # rotors wait for a takeoff
        self._has_flown = False
        self._landed_since = self.now
        k = self._robot.kinematics()
        self.home, self.home_yaw = Vec3(k.north, k.east, k.down), yaw_of(k[6:10])
        self._restart()
        self.say("Arming motors" if self.flies else "Throttle armed")
        self.broadcast_heartbeat()
        return ACCEPTED

    def disarm(self, *, force: bool = False) -> int:
        """Disarm; in the air only by force."""
        if self.in_air and not force:
            self.say("Disarm: in the air", mav.MAV_SEVERITY_WARNING)
            return FAILED
        if self.armed:
            self.armed = self._robot.motors_on = False
            self._restart()
            self.say("Disarming motors" if self.flies else "Throttle disarmed")
            self.broadcast_heartbeat()
        return ACCEPTED

    def set_mode(self, number: int) -> int:
        """Change to the mode with this `custom_mode`."""
        mode = self.identity.mode(number)
        if mode is None:
            self.say(f"No such mode {number}", mav.MAV_SEVERITY_WARNING)
            return FAILED
        self.change_mode(mode)
        return ACCEPTED

    def change_mode(self, mode: Mode) -> None:
        """Enter `mode`, and forget the target and takeoff of the one before."""
        if mode is self.mode:
            return
        self.mode = mode
        self._restart()
        self.broadcast_heartbeat()

    def take_off(self, height: float) -> int:
        """Climb to `height` metres above home, from where the vehicle stands."""
        if not (self.armed and self.mode is Mode.GUIDED and not self.in_air):
            return FAILED
        if not _CLOSE < height < _HIGHEST:
            self.say(f"Takeoff: {height:g} m is out of range", mav.MAV_SEVERITY_WARNING, "takeoff")
            return FAILED
        k = self._robot.kinematics()
        self._takeoff = Vec3(k.north, k.east, self.home.down - height)
        self.target = None
        return ACCEPTED

    def follow(self, message: Message) -> None:
        """Take a SET_POSITION_TARGET_*; heard in GUIDED only. An illegal one means hold."""
        if self.mode is not Mode.GUIDED:
            return
        k = self._robot.kinematics()
        here = Here(
            Vec3(k.north, k.east, k.down), yaw_of(k[6:10]), self.home.down, self.config.origin
        )
        try:
            self.target = parse(message, self.config.kind, here)
        except IllegalTarget as reason:
            self.target = None
            self.say(f"Target refused: {reason}", mav.MAV_SEVERITY_WARNING, topic="target")
        self._takeoff = None
        self._target_at = self.now

    def say(self, text: str, severity: int = mav.MAV_SEVERITY_INFO, topic: str = "") -> None:
        """Send a STATUSTEXT to everybody; the same text (or topic) at most once a second."""
        topic = topic or text
        if self.now - self._texts.get(topic, -_TEXT_INTERVAL) < _TEXT_INTERVAL:
            return
        if len(self._texts) >= _MAX_TOPICS:
            self._texts = {t: at for t, at in self._texts.items() if self.now - at < _TEXT_INTERVAL}
            if len(self._texts) >= _MAX_TOPICS:
                return
        self._texts[topic] = self.now
        for i in range(0, len(text), 50):
            chunk = text[i : i + 50].encode("ascii", "replace")
            self.broadcasts.append(mav.MAVLink_statustext_message(severity, chunk))

    def broadcast_heartbeat(self) -> None:
        """Tell everybody at once that mode or arming has changed."""
        waiting = [m for m in self.broadcasts if m.get_type() != "HEARTBEAT"]
        self.broadcasts = [*waiting, self.heartbeat()]

    def heartbeat(self) -> Message:
        """Return HEARTBEAT as things are now."""
        flags = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        if self.armed:
            flags |= mav.MAV_MODE_FLAG_SAFETY_ARMED
        if self.mode is Mode.GUIDED:
            flags |= mav.MAV_MODE_FLAG_GUIDED_ENABLED
        active = self.in_air if self.flies else self.armed and self.mode is not Mode.HOLD
        message: Message = mav.MAVLink_heartbeat_message(
            self.identity.mav_type,
            AUTOPILOT,
            flags,
            self.identity.number(self.mode),
            mav.MAV_STATE_ACTIVE if active else mav.MAV_STATE_STANDBY,
            3,
        )
        return message

    # Every 10 ms

    def update(self, now: float) -> None:
        """Advance the state machine to `now` and decide the setpoint."""
        self.now = now
        if self.flies:
            if self.armed:
                self._watch_ground()
            # On the ground only a takeoff spins the rotors up; setpoints do not.
            self._robot.motors_on = self.armed and (self.in_air or self._takeoff is not None)
        match self.mode if self.armed else Mode.HOLD:
            case Mode.GUIDED:
                self.setpoint = self._guided()
            case Mode.RTL:
                self.setpoint = self._return()
            case Mode.LAND:
                self.setpoint = self._descend()
            case _:
                self.setpoint = _HOLD

    def _watch_ground(self) -> None:
        if self.in_air:
            self._has_flown = True
            self._landed_since = self.now
        elif self._takeoff is None:
            landing = self._has_flown and self.mode is Mode.LAND
            if self.now - self._landed_since > (_SETTLED if landing else DISARM_DELAY):
                self.disarm()

    def _guided(self) -> Setpoint:
        k = self._robot.kinematics()
        if self._takeoff is not None:
            if abs(k.down - self._takeoff.down) > _CLOSE:
                return Setpoint(position=self._takeoff)
            self.target = PositionTarget(Setpoint(position=self._takeoff), _POSITION_ONLY)
            self._target_at, self._takeoff = _NEVER, None  # nobody streams it
        if self.target and self.now - self._target_at > self.config.setpoint_timeout:
            self._expire(self.target)
        return self.target.at(yaw_of(k[6:10])) if self.target else _HOLD

    def _expire(self, target: PositionTarget) -> None:
        """Nobody has renewed the target within GUID_TIMEOUT: keep a latched position, or hold."""
        self.target = target.expired() if self.config.latch_position else None
        self._target_at = _NEVER
        if self.target != target:
            self.say("Target not received, stopping", mav.MAV_SEVERITY_WARNING)

    def _return(self) -> Setpoint:
        k = self._robot.kinematics()
        near = hypot(k.north - self.home.north, k.east - self.home.east) < _CLOSE
        if self.flies and not self.in_air:
            self.disarm()
            return _HOLD
        if not self.flies:
            if near:
                self.change_mode(Mode.HOLD)
                return _HOLD
            return Setpoint(position=self.home)
        if self._return_at is None:
            ceiling = min(k.down, self.home.down - RTL_ALTITUDE)
            self._return_at = Vec3(k.north, k.east, ceiling)
        if abs(k.down - self._return_at.down) < _CLOSE:
            self._return_at = self._return_at._replace(north=self.home.north, east=self.home.east)
            if near:
                down = self._return_at.down
                self.change_mode(Mode.LAND)
                self._land_at = self.home._replace(down=down)
                return self._descend()
        return Setpoint(position=self._return_at)

    def _descend(self) -> Setpoint:
        if not self.in_air:
            return _HOLD
        k = self._robot.kinematics()
        high = self.home.down - k.down > LAND_SLOW_BELOW
        speed = LAND_SPEED_HIGH if high else LAND_SPEED
        at = self._land_at or Vec3(k.north, k.east, k.down)
        self._land_at = at._replace(down=min(at.down + speed * _UPDATE, k.down + _LAND_LEAD))
        return Setpoint(position=self._land_at, velocity=Vec3(0.0, 0.0, speed))

    def _restart(self) -> None:
        self.target = self._takeoff = self._return_at = self._land_at = None
        self._robot.reset_control()
