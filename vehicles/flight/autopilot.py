"""The flight and drive state machine: modes, home, and what the robot shall do. No I/O, no clock.

MAVLink commands reach it through `protocol/commands.py`; what it wants flown is `setpoint`.
"""

from collections.abc import Callable

from ...transport.frames import Origin, yaw_of
from ...transport.mavlink import Message, mav
from ..config import VehicleConfig
from ..missions.store import MissionStore
from ..parameters.store import Parameters
from ..robot import AttitudeSetpoint, Robot, Setpoint, Vec3
from .arming import ACCEPTED, FAILED, Arming
from .auto import Auto, arming_changed
from .battery import Battery
from .behaviour import HOLD, Behaviour
from .failsafe import Failsafes
from .fence import Fence
from .gaze import Gaze
from .guided import Guided
from .hold import Hold
from .land import Land
from .modes import Mode
from .personality import PERSONALITIES
from .pilot import AltHold, Loiter, Manual, Stabilize
from .rtl import CopterReturn, RoverReturn
from .settings import Settings
from .speaker import Speaker
from .sticks import PilotInput
from .takeoff import CLOSE, Takeoff, TakeoffMode
from .targets import Targets

HIGHEST = 10_000.0  # m, of a takeoff
_TAKES_OFF = (Mode.GUIDED, Mode.LOITER, Mode.ALT_HOLD)
_GUIDES_ITSELF = (Mode.GUIDED, Mode.AUTO, Mode.RTL, Mode.LOITER, Mode.HOLD, Mode.TAKEOFF)

_COPTER: dict[Mode, Callable[["Autopilot"], Behaviour]] = {
    Mode.STABILIZE: Stabilize,
    Mode.ALT_HOLD: AltHold,
    Mode.LOITER: Loiter,
    Mode.HOLD: Hold,
    Mode.GUIDED: Guided,
    Mode.TAKEOFF: TakeoffMode,
    Mode.AUTO: Auto,
    Mode.RTL: CopterReturn,
    Mode.LAND: Land,
}
_ROVER: dict[Mode, Callable[["Autopilot"], Behaviour]] = {
    Mode.MANUAL: Manual,
    Mode.LOITER: Hold,
    Mode.HOLD: Hold,
    Mode.GUIDED: Guided,
    Mode.AUTO: Auto,
    Mode.RTL: RoverReturn,
}
BEHAVIOURS = {"quadcopter": _COPTER, "rover": _ROVER}


class Autopilot:
    """Decides what one robot does. `update` is called every 10 ms with seconds since boot."""

    def __init__(
        self,
        config: VehicleConfig,
        robot: Robot,
        parameters: Parameters,
        settings: Settings,
        missions: MissionStore,
    ) -> None:
        self.config = config
        self.origin: Origin = config.origin
        self.robot = robot
        self.parameters = parameters
        self.settings = settings
        self.personality = PERSONALITIES[config.autopilot]
        self.modes = self.personality.modes[config.kind]
        self.flies = config.kind == "quadcopter"
        number = settings.initial_mode
        self.mode = (None if number is None else self.modes.mode(number)) or self.modes.boot
        self.now = 0.0
        self.home = Vec3(config.north, config.east, config.down)
        self.home_yaw = config.yaw
        self.takeoff_height: float | None = None  # that NAV_TAKEOFF gave mode TAKEOFF
        self.wants_reboot = False
        self.setpoint: Setpoint | AttitudeSetpoint = HOLD
        self.speaker = Speaker()
        self.missions = missions
        self.pilot = PilotInput(self)
        self.battery = Battery(self)
        self.fence = Fence(self)
        self.failsafes = Failsafes(self)
        self.gaze = Gaze(self)
        self.targets = Targets(self)
        self.arming = Arming(self)
        self.climb: Takeoff | None = None  # under way, whatever the mode does afterwards
        self.behaviour: Behaviour
        self._home_is_set = False  # by the user: arming leaves it alone
        self._begin()
        self.speaker.broadcast(self.heartbeat())

    # What others read

    @property
    def armed(self) -> bool:
        """Whether the motors may run."""
        return self.arming.armed

    @property
    def in_air(self) -> bool:
        """Whether the vehicle has left the ground."""
        return self.flies and not self.robot.on_ground

    @property
    def lifts(self) -> bool:
        """Whether the vehicle may leave the ground now."""
        return self.climb is not None or self.behaviour.lifts

    @property
    def lacks_stream(self) -> bool:
        """Whether this flight stack wants setpoints before it is guided, and has none."""
        age = self.now - self.targets.heard_at
        return self.personality.guided_needs_stream and age > self.settings.offboard_loss_timeout

    @property
    def landed_state(self) -> int:
        """Return MAV_LANDED_STATE."""
        if not self.in_air:
            return int(mav.MAV_LANDED_STATE_ON_GROUND)
        if self.behaviour.lands:
            return int(mav.MAV_LANDED_STATE_LANDING)
        if self.climb is not None or self.mode is Mode.TAKEOFF:
            return int(mav.MAV_LANDED_STATE_TAKEOFF)
        return int(mav.MAV_LANDED_STATE_IN_AIR)

    # What commands do; each returns a MAV_RESULT

    def set_mode(self, number: int) -> int:
        """Change to the mode with this `custom_mode`."""
        mode = self.modes.mode(number)
        if mode is None:
            name = self.modes.refused.get(number)
            unknown = self.personality.no_such_mode.format(number)
            text = f"Mode {name} is not supported" if name else unknown
            self.say(text, mav.MAV_SEVERITY_WARNING)
            return self.personality.mode_refusal
        return self.enter(mode)

    def enter(self, mode: Mode) -> int:
        """Change to `mode`, or say why not."""
        if mode not in self.modes.rows:
            return int(mav.MAV_RESULT_UNSUPPORTED)
        if mode is not self.mode and (reason := self._entry_refusal(mode)):
            text = f"Mode change to {self.modes.name(mode)} failed: {reason}"
            self.say(text, mav.MAV_SEVERITY_WARNING)
            return self.personality.mode_refusal
        self.change_mode(mode)
        return ACCEPTED

    def change_mode(self, mode: Mode) -> None:
        """Enter `mode`, and forget the target and takeoff of the one before."""
        if mode is self.mode:
            return
        self.mode = mode
        if mode is not Mode.TAKEOFF:
            self.takeoff_height = None
        self.robot.speed_limit = self.robot.climb_limit = self.robot.descent_limit = None
        self._begin()
        self.speaker.broadcast(self.heartbeat())

    def take_off(self, height: float) -> int:
        """Climb to `height` metres above home, from where the vehicle stands; never down."""
        stands = self.home.down - self.robot.kinematics().down
        if not (height < HIGHEST and height - stands > CLOSE):
            self.say(f"Takeoff: {height:g} m is out of range", mav.MAV_SEVERITY_WARNING, "takeoff")
            return FAILED
        if self.in_air:
            return FAILED
        if self.personality.takeoff_enters_mode:
            self.takeoff_height = height
            self.change_mode(Mode.TAKEOFF)
            return ACCEPTED
        if not (self.armed and self.mode in _TAKES_OFF):
            return FAILED
        self.targets.forget()
        self.climb = Takeoff(self, height)
        return ACCEPTED

    def follow(self, message: Message) -> None:
        """Take a SET_POSITION_TARGET_* or SET_ATTITUDE_TARGET; most heed it in GUIDED only."""
        if self.mode is Mode.GUIDED or self.personality.targets_heard_in_any_mode:
            self.targets.follow(message)

    def reposition(self, place: Vec3, yaw: float | None, speed: float) -> int:
        """Go to a place (local NED) and stay there, in GUIDED (PX4: in HOLD)."""
        wanted = self.personality.reposition_mode
        if self.mode is not wanted and (refusal := self.enter(wanted)) != ACCEPTED:
            return refusal
        if speed > 0:
            self.robot.speed_limit = speed
        self.climb = None
        if isinstance(self.behaviour, Hold):
            self.behaviour.go_to(place, yaw)
        else:
            self.targets.go_to(place, yaw)
        return ACCEPTED

    def set_home(self, home: Vec3, *, by_user: bool = True) -> None:
        """Move home (local NED); one that the user has set stays when arming."""
        self.home = home
        self._home_is_set = by_user
        self.speaker.urgent.add(mav.MAVLINK_MSG_ID_HOME_POSITION)

    def say(self, text: str, severity: int = mav.MAV_SEVERITY_INFO, topic: str = "") -> None:
        """Send a STATUSTEXT to everybody; what streams provoke has a topic, said once a second."""
        self.speaker.say(text, severity, topic, self.now)

    def introduction(self) -> list[str]:
        """Return the texts by which ArduPilot introduces itself when parameters are listed."""
        if not self.personality.banner:
            return []
        frame = ["Frame: QUAD/PLUS"] if self.flies else []
        return [f"{self.modes.firmware} {self.personality.banner}", *frame]

    def heartbeat(self) -> Message:
        """Return HEARTBEAT as things are now."""
        message: Message = mav.MAVLink_heartbeat_message(
            self.modes.mav_type,
            self.personality.autopilot,
            self._base_mode(),
            self.modes.number(self.mode),
            self._system_status(),
            3,
        )
        return message

    # What happens

    def on_arming(self) -> None:
        """Begin the mode anew, with home here unless the user has set it."""
        if self.armed and not self._home_is_set:
            k = self.robot.kinematics()
            self.home_yaw = yaw_of(k[6:10])
            self.set_home(Vec3(k.north, k.east, k.down), by_user=False)
        arming_changed(self)
        self._begin()
        self.speaker.broadcast(self.heartbeat())

    def update(self, now: float) -> None:
        """Advance the state machine to `now` and decide the setpoint; called every 10 ms."""
        self.now = now
        self.battery.update()
        self.arming.watch()
        self.failsafes.update()
        self.robot.motors_on = self.armed
        if not self.armed:
            self.setpoint = HOLD
        elif self.climb is not None:
            self.setpoint = self._climb(self.climb)
        else:
            setpoint = self.behaviour.update()
            self.setpoint = setpoint if not self.flies or self.in_air or self.lifts else HOLD

    def _climb(self, climb: Takeoff) -> Setpoint | AttitudeSetpoint:
        """Take off; a target that comes in meanwhile takes over."""
        if self.targets.current is None and not climb.done:
            return self.gaze.apply(climb.setpoint)
        self.climb = None
        if self.targets.current is None and self.mode is Mode.GUIDED:
            self.targets.stay_at(climb.position)
        return self.behaviour.update()

    def _begin(self) -> None:
        """Begin the present mode from scratch."""
        self.climb = None
        self.robot.reset_control()
        self.gaze.forget()
        if not self.personality.guided_needs_stream:
            self.targets.forget()
        self.behaviour = BEHAVIOURS[self.config.kind][self.mode](self)

    def _entry_refusal(self, mode: Mode) -> str | None:
        """Return why `mode` cannot be entered now, None when it can."""
        needs_mission = self.armed or self.modes.auto_needs_mission
        if mode is Mode.AUTO and needs_mission and not self.missions.mission.items:
            return "no mission"
        if mode is Mode.GUIDED and self.in_air and self.lacks_stream:
            return "no setpoints"
        return None

    def _base_mode(self) -> int:
        """Return MAV_MODE_FLAGs, as ArduPilot sets them."""
        flags: int = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        if self.armed:
            flags |= mav.MAV_MODE_FLAG_SAFETY_ARMED
        if self.flies:
            flags |= mav.MAV_MODE_FLAG_STABILIZE_ENABLED | mav.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
        elif self.mode is Mode.MANUAL:
            flags |= mav.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
        if self.mode in _GUIDES_ITSELF and (self.flies or self.mode is not Mode.HOLD):
            flags |= mav.MAV_MODE_FLAG_GUIDED_ENABLED
        return flags

    def _system_status(self) -> int:
        if self.failsafes.active:
            return int(mav.MAV_STATE_CRITICAL)
        active = self.in_air if self.flies else self.mode is not Mode.HOLD
        return int(mav.MAV_STATE_ACTIVE if active else mav.MAV_STATE_STANDBY)
