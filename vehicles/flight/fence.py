"""The fence: a circle and heights around home, and the areas of the fence list.

A breach is told once and met once with the user's action; setting GUIDED again afterwards is
allowed. Twenty metres farther out it is a new breach, as on ArduPilot. Positions beyond the fence
that somebody asks for are refused. A rover in GUIDED brakes before there is a breach
(`avoidance.py`); what ArduPilot's avoidance does besides is not done here.
"""

from math import hypot, inf
from typing import TYPE_CHECKING

from ...transport.mavlink import mav
from ..robot import Vec3
from .areas import Areas
from .modes import Mode
from .reaction import QUIET, react
from .settings import Action
from .wording import FenceWords, Line, wording

if TYPE_CHECKING:
    from .autopilot import Autopilot

HEIGHT, CIRCLE, LIST, FLOOR = 1, 2, 4, 8  # FENCE_TYPE
ALL = HEIGHT | CIRCLE | LIST | FLOOR

_KINDS = {"quadcopter": ALL, "rover": CIRCLE | LIST}
_TYPES = (  # of breaches, the gravest first
    (CIRCLE | LIST, int(mav.FENCE_BREACH_BOUNDARY)),
    (HEIGHT, int(mav.FENCE_BREACH_MAXALT)),
    (FLOOR, int(mav.FENCE_BREACH_MINALT)),
)
_LANDS = (Mode.LAND, Mode.RTL)  # where the floor does not count
_OFF, _ON, _FLOOR_OFF = 0, 1, 2  # DO_FENCE_ENABLE
_RECOVERY = 10.0  # s that a pilot who takes over outside is let alone
_MAX_COUNT = 65_500

Depths = dict[int, float]
"""How far beyond each fence (FENCE_TYPE) the vehicle is, in m; 0 for the list."""


class Breaches:
    """What the vehicle is beyond, and the history that FENCE_STATUS tells."""

    def __init__(self, again_after: float) -> None:
        self.count = 0
        self.since = 0.0  # s since boot, when the vehicle last left the fence
        self._again_after = again_after
        self._again_at: Depths = {}  # by kind of fence that the vehicle is beyond

    @property
    def mask(self) -> int:
        """Return the FENCE_TYPEs that the vehicle is beyond."""
        return sum(self._again_at)

    @property
    def type(self) -> int:
        """Return FENCE_BREACH."""
        return next((t for mask, t in _TYPES if self.mask & mask), int(mav.FENCE_BREACH_NONE))

    def note(self, depths: Depths, now: float) -> Depths:
        """Take up what the vehicle is beyond now; return the part that is news."""
        if depths and not self._again_at:
            self.since = now
        self._again_at = {k: v for k, v in self._again_at.items() if k in depths}
        news = {k: d for k, d in depths.items() if d >= self._again_at.get(k, -inf)}
        for kind, depth in news.items():
            self.count = min(self.count + 1, _MAX_COUNT)
            self._again_at[kind] = depth + self._again_after if kind != LIST else inf
        return news


class Fence:
    """Watches one vehicle; the failsafes call `update` every 100 ms."""

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._settings = autopilot.settings.fence
        self._words = wording(autopilot.personality.name, autopilot.config.kind).fence
        self._areas = Areas()
        self._switched: int | None = None  # kinds that are on by command
        self._was_enabled = self._settings.enabled
        self._floor_counts = False  # the vehicle has risen above it
        self._led_to: Mode | None = None  # what the last action has led to
        self._quiet_until = 0.0
        self.breaches = Breaches(self._words.again_after)

    @property
    def present(self) -> int:
        """Return the mask of FENCE_TYPEs that there are, on or off."""
        s, autopilot = self._settings, self._autopilot
        self._areas.follow(autopilot.missions.fence, autopilot.origin)
        there = FLOOR
        there |= HEIGHT if s.height else 0
        there |= CIRCLE if s.radius else 0
        there |= LIST if self._areas else 0
        return s.types & there & _KINDS[autopilot.config.kind]

    @property
    def enabled(self) -> int:
        """Return the mask of FENCE_TYPEs that count now."""
        on = ALL if self._settings.enabled else 0
        on = on if self._switched is None else self._switched
        return on and on & self.present

    @property
    def safe_height(self) -> float:
        """Return how high above home the vehicle may go by itself, in m: the margin is kept."""
        return self._settings.height - self._settings.margin if self.enabled & HEIGHT else inf

    def enable(self, what: int, kinds: int = 0) -> int:
        """Switch fences off (0) or on (1), or the floor off (2), until FENCE_ENABLE changes.

        `kinds` is a mask of FENCE_TYPEs, 0: all. Returns a MAV_RESULT.
        """
        kinds = kinds or ALL
        if what not in (_OFF, _ON, _FLOOR_OFF) or not 0 < kinds <= ALL:
            return int(mav.MAV_RESULT_DENIED)
        if what == _ON and not self.present & kinds:
            return int(mav.MAV_RESULT_FAILED)
        off = FLOOR if what == _FLOOR_OFF else kinds
        self._switched = self.enabled | kinds if what == _ON else self.enabled & ~off
        return int(mav.MAV_RESULT_ACCEPTED)

    def refusal(self, position: Vec3) -> str | None:
        """Return which fence a position (local NED) is beyond, None where it may be asked for."""
        if not (self._words.ends_targets and self.enabled):
            return None
        depths = self._depths(position)
        beyond = sum(kind for kind, depth in depths.items() if depth > 0 or kind == LIST)
        return f"beyond the {_named(beyond, self._words)}" if beyond else None

    def allows(self, position: Vec3) -> bool:
        """Return whether a place (local NED) is beyond no fence that counts."""
        return not (self.enabled and self._depths(position))

    def arming_refusal(self) -> str | None:
        """Return why the fence forbids arming, as ArduPilot words it; None if it does not."""
        s, on = self._settings, self.enabled
        if s.enabled and not self.present and self._words.must_exist:
            return "Fences enabled, but none selected"
        heights = on & HEIGHT and self._autopilot.flies
        beyond = self.breaches.mask & on
        reasons = (
            (
                on & LIST and self._areas.narrowest < s.margin,
                "Polygon fence margin is less than inclusion circle radius",
            ),
            (on & CIRCLE and s.radius < 0, "Invalid Circle FENCE_RADIUS value"),
            (on & CIRCLE and s.radius < s.margin, "Circle FENCE_MARGIN is less than FENCE_RADIUS"),
            (heights and s.height < 0, "Invalid FENCE_ALT_MAX value"),
            (beyond, f"Vehicle breaching {_named(beyond, self._words)}"),
            (on and s.margin < 0, "Invalid FENCE_MARGIN value"),
            (heights and s.height < s.floor, "FENCE_ALT_MAX < FENCE_ALT_MIN"),
            (heights and s.height - s.floor <= 2 * s.margin, "FENCE_MARGIN too big"),
        )
        return next((text for applies, text in reasons if applies), None)

    def update(self) -> None:
        """Compare the vehicle with its fence; tell and meet a new breach, and its end."""
        autopilot, before = self._autopilot, self.breaches.mask
        if self._settings.enabled != self._was_enabled:
            self._was_enabled, self._switched = self._settings.enabled, None
        if not (before or self.enabled):
            return
        k = autopilot.robot.kinematics()
        self._watch_floor(autopilot.home.down - k.down)
        depths = self._depths(Vec3(k.north, k.east, k.down))
        news = self.breaches.note(depths, autopilot.now)
        if not autopilot.armed:
            self._led_to, self._quiet_until = None, 0.0  # the next flight begins anew
            return
        if self._led_to not in (None, autopilot.mode) and self.breaches.mask:
            self._led_to = None
            if self._words.recovery is not None:
                self._quiet_until = autopilot.now + _RECOVERY
                self._say(self._words.recovery)
        if news and autopilot.now >= self._quiet_until:
            self._meet(news)
        elif before and not depths:
            self._led_to = None
            self._say(self._words.cleared)

    def _depths(self, position: Vec3) -> Depths:
        """Return how far beyond the fences that count a position is."""
        s, home, on = self._settings, self._autopilot.home, self.enabled
        depths: Depths = {}
        if on & HEIGHT:
            depths[HEIGHT] = home.down - position.down - s.height
        if on & FLOOR and self._floor_counts:
            depths[FLOOR] = position.down - home.down + s.floor
        if on & CIRCLE:
            distance = hypot(position.north - home.north, position.east - home.east)
            depths[CIRCLE] = distance - s.radius
        if on & LIST:
            point, any_will_do = (position.north, position.east), self._words.any_area_will_do
            depths[LIST] = -1.0 if self._areas.allow(point, any_inclusion=any_will_do) else 0.0
        return {kind: depth for kind, depth in depths.items() if depth >= 0}

    def _watch_floor(self, height: float) -> None:
        """Let the floor count once the vehicle is above it, until it comes down to land."""
        autopilot, s = self._autopilot, self._settings
        landing = autopilot.landed_state == mav.MAV_LANDED_STATE_LANDING or autopilot.mode in _LANDS
        if not autopilot.in_air or landing:
            self._floor_counts = False
        elif height >= s.floor + s.margin:
            self._floor_counts = True

    def _meet(self, news: Depths) -> None:
        """Tell new breaches and do what the user wants done about them."""
        autopilot, action, words = self._autopilot, self._settings.action, self._words
        if action is Action.NONE:
            return
        if autopilot.in_air or not autopilot.flies:
            each = [sum(news)] if words.one_line else list(news)
            for kinds in each:
                text = words.breached.text.format(_named(kinds, words))
                self._say(Line(words.breached.severity, text))
        if action in QUIET:
            return
        self._say(words.acted)
        if action is Action.RTL and max(news.values()) > words.too_far:
            action = Action.LAND
        react(autopilot, action)
        self._led_to = autopilot.mode

    def _say(self, line: Line | None) -> None:
        if line is not None:
            self._autopilot.say(line.text, line.severity)


def _named(kinds: int, words: FenceWords) -> str:
    """Return "Max Alt and Circle fences"."""
    names = [name for kind, name in words.names.items() if kinds & kind]
    text = " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))
    return words.named.format(text, "s" if len(names) > 1 else "")
