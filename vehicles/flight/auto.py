"""AUTO (PX4: MISSION): flies the mission list, item by item."""

from math import isfinite
from typing import TYPE_CHECKING

from ...transport.mavlink import Message, mav
from ..missions.items import Item
from ..missions.supported import SUPPORTED
from ..robot import AttitudeSetpoint, Setpoint
from .behaviour import HOLD
from .legs import Leg, WaypointLeg, make_leg
from .modes import Mode
from .steps import Steps

if TYPE_CHECKING:
    from .autopilot import Autopilot

_SHORTEST = 0.1  # s that a NAV item lasts at least: jumps round a reached waypoint flood nobody
_THROTTLE_UP = 0.1  # of a stick's travel: a pilot who raises it starts the mission
_NO_MISSION = 0xFFFF  # MISSION_CURRENT.total
_REACHED = {"quadcopter": "Reached command #{}", "rover": "Reached waypoint #{}"}


class Auto:
    """Flies NAV items in turn, with DO and CONDITION items alongside.

    How far it has got is `autopilot.missions.progress`, so that leaving AUTO only pauses: coming
    back resumes the item that was under way, unless MIS_RESTART says to begin anew or the
    mission was over. A copter on the ground waits for MISSION_START or a raised throttle stick, a
    rover starts when armed.
    """

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._list = autopilot.missions.mission
        self._revision = self._list.revision
        self._progress = progress = autopilot.missions.progress
        self._steps = Steps(autopilot, self._begun, self._completed)
        self._leg: Leg | None = None
        self._item: Item | None = None
        self._rest: Setpoint = HOLD  # after the last item
        self._begun_at = 0.0
        self.paused = False  # by DO_PAUSE_CONTINUE
        if not autopilot.armed:
            return
        if autopilot.in_air or not autopilot.flies or autopilot.personality.missions_take_off:
            progress.started = True
        if progress.complete or autopilot.settings.mission_restart:
            progress.begin_again()
        elif progress.wanted is None:
            progress.wanted = progress.current
        for name, limit in progress.speed_limits.items():
            setattr(autopilot.robot, name, limit)

    @property
    def lifts(self) -> bool:
        """Whether a takeoff is under way, or about to be."""
        return self._leg.lifts if self._leg is not None else self._is_due()

    @property
    def lands(self) -> bool:
        """Whether the item under way lets the vehicle down."""
        return self._leg is not None and self._leg.lands

    def update(self) -> Setpoint | AttitudeSetpoint:
        """Return what the item under way asks for; go on with the next when it is done."""
        progress = self._progress
        self._notice_upload()
        if self.paused:
            return HOLD
        if progress.wanted is not None and progress.started:
            self._leg = None
        if self._leg is None:
            if not progress.started and _is_throttle_up(self._autopilot):
                progress.started = True
            if self._is_due():
                self._advance()
        leg = self._leg
        if leg is None:
            self._steps.update()
            return self._rest
        setpoint = leg.update()
        self._steps.update()
        if leg.done and self._autopilot.now - self._begun_at >= _SHORTEST:
            self._arrive()
        if isinstance(setpoint, AttitudeSetpoint):
            return setpoint
        return self._autopilot.gaze.apply(setpoint)

    def start(self) -> None:
        """Leave the ground, or go on: MISSION_START."""
        if self._progress.complete:
            self._progress.begin_again()
        self._progress.started = True

    def _is_due(self) -> bool:
        """Whether the mission shall begin or go on, and can."""
        progress = self._progress
        return progress.started and not progress.complete and len(self._list) > 0

    def _notice_upload(self) -> None:
        """Fly the current item anew when an upload changed it; a lost one is flown to its end."""
        if self._list.revision == self._revision:
            return
        self._revision = self._list.revision
        self._steps.forget()
        current, items = self._progress.current, self._list.items
        flying = self._leg is not None and self._progress.wanted is None
        if (
            flying
            and current is not None
            and items[current : current + 1] not in ((), (self._item,))
        ):
            self._progress.wanted = current
        self._tell_current()

    def _advance(self) -> None:
        """Begin the next NAV item, or come to the end."""
        others, index = self._progress.advance(self._list.items)
        self._begun_at = self._autopilot.now
        if index is None:
            self._steps.begin(others)
            self._progress.complete = True
            self._autopilot.say("Mission Complete", mav.MAV_SEVERITY_NOTICE)
        else:
            self._steps.begin(others)
            self._item = self._begun(index)
            self._leg = make_leg(self._autopilot, self._item)
            self._steps.goal = self._leg.goal
        self._tell_current()

    def _arrive(self) -> None:
        """Say that the NAV item is done, and go on at once."""
        leg, index = self._leg, self._progress.current
        if leg is None or index is None:
            return
        if isinstance(leg, WaypointLeg):
            self._autopilot.say(_REACHED[self._autopilot.config.kind].format(self._seq(index)))
        self._completed(index)
        self._leg = None
        stays = leg.goal is not None and (self._autopilot.in_air or not self._autopilot.flies)
        self._rest = Setpoint(position=leg.goal) if stays else HOLD
        self._advance()

    def _begun(self, index: int) -> Item:
        item = self._list.items[index]
        self._autopilot.say(f"Mission: {self._seq(index)} {SUPPORTED[item.command].text}")
        return item

    def _completed(self, index: int) -> None:
        self._autopilot.speaker.broadcast(
            mav.MAVLink_mission_item_reached_message(self._seq(index))
        )

    def _seq(self, index: int) -> int:
        return index + self._autopilot.missions.first_seq

    def _tell_current(self) -> None:
        self._autopilot.speaker.broadcast(mission_current_message(self._autopilot))


def start_mission(autopilot: "Autopilot", first: float = 0.0, last: float = 0.0) -> int:
    """Answer MISSION_START (MAV_RESULT): enter AUTO and begin, at item `first` if it is not 0.

    Disarmed, the mission begins when the vehicle is armed in AUTO. Ending before the list does
    is not supported: `last` must be 0 or the last item.
    """
    missions = autopilot.missions
    final = len(missions.mission) - 1 + missions.first_seq
    if not (isfinite(first) and isfinite(last)) or (last and int(last) != final):
        return int(mav.MAV_RESULT_DENIED)
    if not len(missions.mission):
        autopilot.say("Mission: there is none to start", mav.MAV_SEVERITY_WARNING)
        return int(mav.MAV_RESULT_FAILED)
    if first and not missions.set_current(int(first)):
        return int(mav.MAV_RESULT_DENIED)
    result = autopilot.enter(Mode.AUTO)
    if result == mav.MAV_RESULT_ACCEPTED and isinstance(autopilot.behaviour, Auto):
        autopilot.behaviour.start()
    return result


def set_mission_current(autopilot: "Autopilot", seq: float, *, reset: bool = False) -> bool:
    """Go on with the item that the ground calls `seq`, and tell everybody; False: none such."""
    if not (isfinite(seq) and autopilot.missions.set_current(int(seq), reset=reset)):
        autopilot.say("Mission: no such item", mav.MAV_SEVERITY_WARNING)
        return False
    autopilot.speaker.broadcast(mission_current_message(autopilot))
    return True


def arming_changed(autopilot: "Autopilot") -> None:
    """Forget the place in the mission when a flight is over; to be called before AUTO begins.

    A rover that is disarmed in AUTO goes on from there (ArduRover). A start that was given
    before arming counts only if AUTO is still the mode.
    """
    progress, in_auto = autopilot.missions.progress, autopilot.mode is Mode.AUTO
    if not autopilot.armed and (autopilot.flies or not in_auto):
        progress.reset()
    elif not in_auto:
        progress.started = False


def mission_current_message(autopilot: "Autopilot") -> Message:
    """Return MISSION_CURRENT as things are now."""
    missions, in_auto = autopilot.missions, autopilot.mode is Mode.AUTO
    progress, total = missions.progress, len(missions.mission)
    if not total:
        state = mav.MISSION_STATE_NO_MISSION
    elif progress.complete:
        state = mav.MISSION_STATE_COMPLETE
    elif progress.current is None:
        state = mav.MISSION_STATE_NOT_STARTED
    else:
        behaviour = autopilot.behaviour
        active = autopilot.armed and isinstance(behaviour, Auto) and not behaviour.paused
        state = mav.MISSION_STATE_ACTIVE if active else mav.MISSION_STATE_PAUSED
    shown = progress.shown
    message: Message = mav.MAVLink_mission_current_message(
        0 if shown is None else min(shown + missions.first_seq, 0xFFFF),
        total or _NO_MISSION,
        state,
        1 if in_auto else 2,  # mission_mode: flying it, or suspended
    )
    return message


def _is_throttle_up(autopilot: "Autopilot") -> bool:
    throttle = autopilot.pilot.sticks.throttle
    return throttle is not None and throttle > _THROTTLE_UP
