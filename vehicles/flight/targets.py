"""The target that somebody outside has set: what it is, how old it is, and when it expires."""

from typing import TYPE_CHECKING

from ...transport.frames import yaw_of
from ...transport.mavlink import Message, mav
from ..robot import AttitudeSetpoint, Setpoint, Vec3
from .attitude_target import AttitudeTarget, parse_attitude
from .avoidance import within_fence
from .behaviour import HOLD
from .modes import Mode
from .position_target import Here, IllegalTarget, PositionTarget, along, parse, rules_of, to_place

if TYPE_CHECKING:
    from .autopilot import Autopilot

NEVER = float("inf")


class Targets:
    """Keeps the latest target; an illegal one means "stop and hold", or nothing at all."""

    def __init__(self, autopilot: "Autopilot") -> None:
        self.current: PositionTarget | AttitudeTarget | None = None
        self.heard_at = -NEVER  # when the last target came in, s since boot
        self._expires_from = NEVER
        self._autopilot = autopilot
        self._rules = rules_of(autopilot.personality.name, autopilot.config.kind)

    def forget(self) -> None:
        """Have no target."""
        self.current = None
        self._expires_from = NEVER

    def follow(self, message: Message) -> None:
        """Take a SET_POSITION_TARGET_* or SET_ATTITUDE_TARGET."""
        autopilot = self._autopilot
        try:
            if message.get_type() == "SET_ATTITUDE_TARGET":
                target: PositionTarget | AttitudeTarget = parse_attitude(message, autopilot)
            else:
                target = parse(message, self._rules, self.here())
            self._check_fence(target)
        except IllegalTarget as refusal:
            self._refuse(refusal)
        else:
            self.current = target
            if autopilot.mode is Mode.GUIDED:  # a stream before OFFBOARD turns nobody's head
                self._free_nose(target)
            self._expires_from = self.heard_at = autopilot.now

    def go_to(self, position: Vec3, yaw: float | None = None) -> None:
        """Go to a place (local NED) and stay there; raise IllegalTarget beyond the fence."""
        target = to_place(position, yaw)
        self._check_fence(target)
        self.current, self._expires_from = target, NEVER
        self._free_nose(target)

    def stay_at(self, position: Vec3) -> None:
        """Stay at a place that is reached, the nose where it is wanted already."""
        self.current, self._expires_from = to_place(position), NEVER

    def drive(self, yaw: float, speed: float) -> None:
        """Let a rover turn to a heading and drive at a speed (m/s, negative: backwards).

        Like a target with a velocity it expires.
        """
        self.current = along(yaw, speed)
        self._expires_from = self.heard_at = self._autopilot.now

    def here(self) -> Here:
        """Return what a relative target is relative to."""
        autopilot = self._autopilot
        k = autopilot.robot.kinematics()
        where = Vec3(k.north, k.east, k.down)
        return Here(where, yaw_of(k[6:10]), autopilot.home.down, autopilot.origin)

    def setpoint(self) -> Setpoint | AttitudeSetpoint:
        """Return what to do now; expires what nobody has renewed."""
        autopilot, target = self._autopilot, self.current
        if target and autopilot.now - self._expires_from > autopilot.settings.guided_timeout:
            target = self._expire(target) if self._rules.expires else target
        setpoint: Setpoint | AttitudeSetpoint = HOLD if target is None else target.setpoint
        if isinstance(target, PositionTarget) and target.forward_speed is not None:
            setpoint = target.at(yaw_of(autopilot.robot.kinematics()[6:10]))
        if self._rules.avoids and autopilot.settings.fence.avoidance & 1:
            setpoint = within_fence(autopilot, setpoint)
        if isinstance(setpoint, AttitudeSetpoint):
            return setpoint
        return autopilot.gaze.apply(setpoint, faces_way=autopilot.settings.targets_face_way)

    def _refuse(self, refusal: IllegalTarget) -> None:
        """Stop and hold, also while taking off, unless the target is only dropped."""
        autopilot = self._autopilot
        if not refusal.drops:
            self.forget()
            autopilot.climb = None
        if refusal.text:
            autopilot.say(refusal.text, refusal.severity, topic="target")

    def _free_nose(self, target: PositionTarget | AttitudeTarget) -> None:
        """Take the nose back from CONDITION_YAW, and from a region of interest if it is needed."""
        wants = target.setpoint.yaw is not None or target.setpoint.yaw_rate is not None
        if wants:
            self._autopilot.gaze.forget()
        else:
            self._autopilot.gaze.turn(None)

    def _expire(self, target: PositionTarget | AttitudeTarget) -> PositionTarget | None:
        """Keep a latched position, or hold: nobody has renewed the target within GUID_TIMEOUT."""
        autopilot = self._autopilot
        kept = None
        if isinstance(target, PositionTarget) and autopilot.config.latch_position:
            kept = target.expired()
        self.current, self._expires_from = kept, NEVER
        if kept != target and (self._rules.tells_expiry or not autopilot.config.latch_position):
            seconds = autopilot.settings.guided_timeout
            text = f"target not received last {seconds:g}secs, stopping"
            autopilot.say(text, mav.MAV_SEVERITY_WARNING)
        return kept

    def _check_fence(self, target: PositionTarget | AttitudeTarget) -> None:
        if isinstance(target, PositionTarget) and target.setpoint.position is not None:
            reason = self._autopilot.fence.refusal(target.setpoint.position)
            if reason:
                raise IllegalTarget(reason, drops=True)
