"""The scenario's fence: no command leads out of the box. Pure; ENU, m, m/s.

A vehicle's own fence is another matter, and stays the last resort: this one only bounds what the
ground asks for, with room to brake, so that the vehicle's own need not act.
"""

from collections.abc import Callable
from math import cos, inf, sin
from typing import Any, NamedTuple

from ...scenarios.schema import Fence
from ...transport.frames import Triple
from ..laws import HOLD, Command

APPROACH = 0.5  # 1/s: speed towards a side per metre left; 1 m/s^2 (ArduRover's) stops from 2 m/s
RETURN = 1.0  # m/s, the most with which a vehicle outside is asked back


class _Axis(NamedTuple):
    low: float
    high: float

    def clamp(self, x: float) -> float:
        return min(self.high, max(self.low, x))

    def brake(self, v: float, x: float) -> float:
        """Return `v`, at `x`, with no more speed to each side than there is room for."""
        least = min(APPROACH * (self.low - x), RETURN)
        most = max(APPROACH * (self.high - x), -RETURN)
        return min(most, max(least, v))


def confine(fence: Fence, position: Triple, command: Command) -> Command:
    """Return `command` as it may be sent to a vehicle at `position`.

    Target positions are clamped to the box and speeds towards a side fade out before it, down to
    none at the side and to the way back beyond it. An acceleration that pushes the way a speed was
    cut is dropped. There is no lower side: ground is ground. HOLD stays HOLD, also outside: the
    vehicle is told to stop because not enough is known to move it.
    """
    if command == HOLD:
        return command
    axes = (_Axis(*fence.east), _Axis(*fence.north), _Axis(-inf, fence.up))
    target, velocity, push = command.position, command.velocity, command.acceleration
    if target is not None:
        target = _each(_Axis.clamp, axes, target)
    if velocity is not None:
        braked = _each(_Axis.brake, axes, velocity, position)
        push = push and _each(_after_cut, push, velocity, braked)
        velocity = braked
    return command._replace(position=target, velocity=velocity, acceleration=push)


def confine_along(fence: Fence, position: Triple, heading: float, speed: float) -> float:
    """Return the `speed` (m/s, forwards) with which a rover at `position` may drive along its nose.

    One that is still turning drives where its nose points, not where its command does.
    """
    share = 1.0
    for low, high, x, v in (
        (*fence.east, position[0], speed * cos(heading)),
        (*fence.north, position[1], speed * sin(heading)),
    ):
        if v != 0.0:
            share = min(share, max(0.0, _Axis(low, high).brake(v, x) / v))
    return share * speed


def _each(function: Callable[..., float], *triples: tuple[Any, Any, Any]) -> Triple:
    """Return `function` of the eastern, the northern and the upward parts."""
    east, north, up = map(function, *triples)
    return (east, north, up)


def _after_cut(push: float, asked: float, allowed: float) -> float:
    """Return an acceleration, or none where it would undo the cut of the speed."""
    return 0.0 if push * (asked - allowed) > 0 else push
