"""What a mission does beside flying: DO and CONDITION items, one after another."""

from collections.abc import Callable, Sequence
from math import hypot, inf, radians
from typing import TYPE_CHECKING

from ...transport.frames import yaw_of
from ...transport.mavlink import mav
from ..missions.items import Item
from ..robot import Vec3
from .heading import Heading
from .legs import place_of

if TYPE_CHECKING:
    from .autopilot import Autopilot

_TURN_RATE = radians(60)  # rad/s, where CONDITION_YAW gives none
_LIMITS = {0: "speed_limit", 1: "speed_limit", 2: "climb_limit", 3: "descent_limit"}
_AS_TUNED = -2.0
_HERE = 1.0  # param1 of DO_SET_HOME

Condition = Callable[[], bool]


class Steps:
    """Runs the items between two NAV items while the second one is flown.

    A CONDITION holds up those after it; what is left when the NAV item is done is dropped.
    The first is begun before the NAV item, as by ArduPilot, then one in every update, so that a
    list of nothing else floods nobody.
    """

    def __init__(
        self, autopilot: "Autopilot", begun: Callable[[int], Item], done: Callable[[int], None]
    ) -> None:
        self._autopilot = autopilot
        self._begun = begun
        self._done = done
        self._waiting: list[int] = []
        self._at: int | None = None  # the condition that is waited for
        self._condition: Condition | None = None
        self.goal: Vec3 | None = None
        """Where the NAV item leads, for CONDITION_DISTANCE."""

    def begin(self, items: Sequence[int]) -> None:
        """Run these items from now on; a new leg takes the nose back."""
        self._waiting = list(items)
        self._condition = self._at = self.goal = None
        self._autopilot.gaze.turn(None)
        self._begin_next()

    def forget(self) -> None:
        """Drop what waits: the list has changed."""
        self._waiting = []
        self._condition = self._at = None

    def update(self) -> None:
        """Look at the condition, or begin the next item."""
        if self._condition is not None:
            if not self._condition():
                return
            if self._at is not None:
                self._done(self._at)
            self._condition = self._at = None
        self._begin_next()

    def _begin_next(self) -> None:
        if not self._waiting:
            return
        index = self._waiting.pop(0)
        condition = self._run(self._begun(index))
        if condition is None:
            self._done(index)
        else:
            self._at, self._condition = index, condition

    def _run(self, item: Item) -> Condition | None:
        """Do what `item` says; return what to wait for, None when it is done at once."""
        autopilot = self._autopilot
        match item.command:
            case mav.MAV_CMD_CONDITION_DELAY:
                until = autopilot.now + item.param1
                return lambda: autopilot.now >= until
            case mav.MAV_CMD_CONDITION_DISTANCE:
                return lambda: self._distance() <= item.param1
            case mav.MAV_CMD_CONDITION_YAW:
                heading = self._turn(item)
                autopilot.gaze.turn(heading)
                return lambda: heading.done
            case mav.MAV_CMD_DO_CHANGE_SPEED:
                self._change_speed(item)
            case mav.MAV_CMD_DO_SET_HOME:
                k = autopilot.robot.kinematics()
                here = Vec3(k.north, k.east, k.down)
                autopilot.set_home(here if item.param1 == _HERE else place_of(autopilot, item))
            case mav.MAV_CMD_DO_SET_ROI_LOCATION | mav.MAV_CMD_DO_SET_ROI:
                autopilot.gaze.look_at(place_of(autopilot, item) if item.has_place else None)
            case mav.MAV_CMD_DO_SET_ROI_NONE:
                autopilot.gaze.look_at(None)
        return None

    def _distance(self) -> float:
        if self.goal is None:
            return inf
        k = self._autopilot.robot.kinematics()
        return hypot(self.goal.north - k.north, self.goal.east - k.east)

    def _turn(self, item: Item) -> Heading:
        yaw = yaw_of(self._autopilot.robot.kinematics()[6:10])
        direction = (item.param3 > 0) - (item.param3 < 0)
        angle = radians(item.param1 % 360)
        if item.param4 == 1:  # relative to where the nose points, to the right unless told
            angle = yaw + (-angle if direction < 0 else angle)
        rate = radians(item.param2) if item.param2 > 0 else _TURN_RATE
        return Heading(yaw, angle, min(rate, _TURN_RATE), direction)

    def _change_speed(self, item: Item) -> None:
        limit, speed = _LIMITS[int(item.param1)], item.param2
        if speed > 0 or speed == _AS_TUNED:
            value = speed if speed > 0 else None
            setattr(self._autopilot.robot, limit, value)
            self._autopilot.missions.progress.speed_limits[limit] = value
