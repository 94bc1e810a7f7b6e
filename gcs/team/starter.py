"""One vehicle from standing to armed in GUIDED and, if it flies, up."""

from collections.abc import Callable

from ...transport.frames import Triple
from ...transport.wire import VehicleState
from ...vehicles.flight.modes import Mode
from ..laws import Command
from ..safety.takeover import Grip, loss
from ..station import Request, Station, StationError, said_since

RETRY_S = 1.0  # between a refusal and the next try
CLIMBED = 0.2  # m below the height that counts as there, and above the ground as not standing
CLIMB_PATIENCE_S = 8.0  # without getting higher; after 10 s on the ground vehicles disarm
_SHOWN_S = 3.0  # from a yes to the HEARTBEAT that shows it; ArduPilot's boot forgets a mode
_RECENT_S = 5.0  # texts so old may still be the reason of a refusal
_SECOND_THOUGHTS = 1  # one that was armed may disarm itself so often before it is in GUIDED
_HEALTHY_S = 3.0  # in GUIDED: then one may arm that has not said so, its refusal tells why
_BELOW = 0.3  # m under the ground: a set-point right at it is above it at times, and takes off
_RISE = 0.1  # m that count as getting higher


class Starter:
    """Starts one vehicle; what it tells of itself confirms each step before the next. ENU.

    `direct` is to be streamed meanwhile, past any law: some flight stacks want to see set-points
    before they enter GUIDED, and take off by them. None: send nothing, it would break the takeoff
    off.
    """

    def __init__(self, station: Station, kind: str, patience_s: float) -> None:
        self.direct: Command | None = None
        self._station = station
        self._flies = kind == "quadcopter"
        self._patience = patience_s
        self._began_at: float | None = None
        self._stand: Triple | None = None  # where it is before it is armed
        self._step = ""
        self._request: Request | None = None
        self._refusal = ""  # of the step before
        self._asked_at = 0.0
        self._guided_at: float | None = None
        self._armed = False
        self._disarmed = 0  # times, by itself
        self._ours = False  # it was armed in GUIDED, and must stay in our hands
        self._grip = Grip(station)
        self._flew = False  # before we have had it
        self._target_up: float | None = None  # of the position target to climb by
        self._highest = 0.0
        self._rose_at = 0.0

    def arm(self, now: float, me: VehicleState) -> bool:
        """Return whether it is in GUIDED and armed; until then have it so.

        Raises StationError with the vehicle's reasons when patience ends, or when somebody else
        takes it once it was so.
        """
        station, stack = self._station, self._station.stack
        if self._ours and not self._grip.check(now):
            return False
        self._began_at = now if self._began_at is None else self._began_at
        guided = station.in_mode(Mode.GUIDED)
        if not me.armed or self._stand is None:
            self._stand, self._flew = me.position, me.armed and station.status.landed is False
            if stack is not None and stack.needs_stream:
                east, north, up = me.position
                up -= 0.0 if me.armed else _BELOW
                self.direct = Command(position=(east, north, up))
        if self._armed and not me.armed:
            self._disarmed += 1
            if self._disarmed > _SECOND_THOUGHTS:
                raise StationError(loss(station, now))
        self._armed = me.armed
        if not guided:
            self._guided_at = None
            if stack is None or now - self._began_at >= stack.stream_first_s:
                self._ask("mode", now, lambda: station.set_mode(Mode.GUIDED, now))
        elif not me.armed:
            if self._may_arm(now):
                self._ask("arming", now, lambda: station.arm(now))
        else:
            self._ours = True
            return True
        return False

    def _may_arm(self, now: float) -> bool:
        """Return whether one that needs a stream has had it and says that it is well with it."""
        stack, status = self._station.stack, self._station.status
        self._guided_at = now if self._guided_at is None else self._guided_at
        if stack is None or not stack.needs_stream or now - self._guided_at >= _HEALTHY_S:
            return True
        streamed = now - (self._began_at or 0.0) >= stack.stream_first_s
        return streamed and (status.prearm_ok is True or status.sensors is None)

    def climb(self, now: float, me: VehicleState, up: float) -> bool:
        """Return whether it is `up` metres above the fleet's plane; until then have it climb.

        To be called when, and as long as, `arm` is true. Raises StationError when it
        does not get higher.
        """
        station, stack = self._station, self._station.stack
        stand = self._stand or me.position
        height, ground = me.position[2], stand[2]
        if height >= up - CLIMBED:
            return True
        if self._flew or (stack is not None and stack.climbs_by_target):
            east, north, _ = me.position if self._flew else stand
            if self._target_up != up:
                self._target_up = up
                self.direct = Command(position=(east, north, up))
                self._highest, self._rose_at = height, now
        elif height < ground + CLIMBED:
            if self._step != "takeoff":
                self._highest, self._rose_at = height, now
            self._ask("takeoff", now, lambda: station.take_off(up - ground, now))
        if height > self._highest + _RISE:
            self._highest, self._rose_at = height, now
        elif now - self._rose_at > CLIMB_PATIENCE_S:
            text = f"{station.name}: does not climb: {max(0.0, height):.1f} m up, not {up:g} m"
            if self._refusal:
                text += f" ({self._refusal})"
            raise StationError(text + said_since(station.status.texts, self._rose_at))
        return False

    def _ask(self, step: str, now: float, send: Callable[[], Request]) -> None:
        """Ask for a step once, and again after a refusal or a yes that does not show."""
        request = self._request
        if request is not None and self._step == step:
            if not request.done:
                return
            if now > (self._began_at or 0.0) + self._patience and step != "takeoff":
                raise StationError(self._reason(request, now))
            if now < self._asked_at + (RETRY_S if request.refused else _SHOWN_S):
                return
            self._refusal = request.problem
        self._step, self._asked_at = step, now
        self._request = send()

    def _reason(self, request: Request, now: float) -> str:
        """Return why a step was not done, with all that the vehicle has said of late."""
        problem = request.problem
        if request.accepted:
            problem = f"{self._station.name}: accepts {request.what}, but does not do it"
        return problem + said_since(request.heard, now - _RECENT_S)
