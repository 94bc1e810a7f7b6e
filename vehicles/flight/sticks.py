"""Where a pilot's sticks are: MANUAL_CONTROL and RC_CHANNELS_OVERRIDE as radio channels."""

from typing import TYPE_CHECKING, NamedTuple

from ...transport.mavlink import Message

if TYPE_CHECKING:
    from .autopilot import Autopilot

CHANNELS = 18
_LOW, _TRIM, _HIGH = 1000, 1500, 2000  # us
_LEAST, _MOST = 800, 2200  # us, what a radio could send
_ROLL, _PITCH, _THROTTLE, _YAW = 0, 1, 2, 3  # channel minus one, as RCMAP_* says
_DEADZONE = 0.05  # of a centred stick's travel
_NOT_GIVEN = 0x7FFF  # of MANUAL_CONTROL
_IGNORE, _RELEASE = 0xFFFF, 0  # of RC_CHANNELS_OVERRIDE
_RELEASE_HIGH = 0xFFFE  # and of its channels 9 to 18, where 0 also says "ignore"
_FIRST_HIGH = 8
_FULL = 1000  # of MANUAL_CONTROL


class Sticks(NamedTuple):
    """Where the sticks are; those that nobody moves are centred."""

    roll: float = 0.0  # -1..1, positive leans or steers right
    pitch: float = 0.0  # -1..1, positive pulls back
    yaw: float = 0.0  # -1..1, positive turns right
    throttle: float | None = None  # 0..1, a rover's -1..1; None: nobody has it


class PilotInput:
    """The radio that ground stations replace: each channel expires by itself.

    ArduPilot heeds one station only (SYSID_MYGCS). Channels 5 and 8, where a real radio
    switches modes, are kept and shown, but switch nothing.
    """

    def __init__(self, autopilot: "Autopilot") -> None:
        self._autopilot = autopilot
        self._flies = autopilot.flies
        self._heard_at: float | None = None  # s since boot; None: never, or he has let go
        self._pulses: dict[int, tuple[int, float]] = {}  # by channel: us, and when it expires
        reverses = not self._flies and autopilot.personality.throttle_reverses
        self._throttle_low = -_FULL if reverses else 0

    @property
    def lost(self) -> bool:
        """Whether a pilot who was heard is silent now."""
        autopilot = self._autopilot
        if self._heard_at is None:
            return False
        return autopilot.now - self._heard_at > autopilot.settings.pilot_loss_timeout

    @property
    def sticks(self) -> Sticks:
        """Return where the sticks are now."""
        throttle: float | None = self._pulse(_THROTTLE)
        if throttle is not None:
            travel = (min(max(throttle, _LOW), _HIGH) - _LOW) / (_HIGH - _LOW)
            throttle = travel if self._flies else _beyond_deadzone(2 * travel - 1)
        return Sticks(self._centred(_ROLL), self._centred(_PITCH), self._centred(_YAW), throttle)

    @property
    def channels(self) -> tuple[int, ...]:
        """Return the 18 channels in us, as RC_CHANNELS shows them; untouched ones at rest."""
        rest = [_TRIM] * CHANNELS
        if self._flies:
            rest[_THROTTLE] = _LOW
        return tuple(self._pulse(i) or rest[i] for i in range(CHANNELS))

    def take(self, message: Message, now: float) -> None:
        """Take a MANUAL_CONTROL or an RC_CHANNELS_OVERRIDE."""
        autopilot = self._autopilot
        if (
            autopilot.personality.sticks_of_one_station
            and message.get_srcSystem() != autopilot.settings.gcs_system_id
        ):
            return
        if message.get_type() == "MANUAL_CONTROL":
            if message.target == autopilot.config.system_id:
                self._take_sticks(message, now)
        else:
            self._take_channels(message, now)

    def _take_sticks(self, m: Message, now: float) -> None:
        """Turn joystick axes into channels, as a radio would send them."""
        for channel, value, low in (
            (_ROLL, m.y, -_FULL),
            (_PITCH, -m.x if m.x != _NOT_GIVEN else _NOT_GIVEN, -_FULL),
            (_THROTTLE, m.z, self._throttle_low),
            (_YAW, m.r, -_FULL),
        ):
            if value != _NOT_GIVEN:
                travel = (min(max(value, low), _FULL) - low) / (_FULL - low)
                self._set(channel, round(_LOW + travel * (_HIGH - _LOW)), now)

    def _take_channels(self, m: Message, now: float) -> None:
        for channel in range(CHANNELS):
            pulse: int = getattr(m, f"chan{channel + 1}_raw")
            high = channel >= _FIRST_HIGH
            if pulse == _IGNORE or (high and pulse == 0):
                continue
            if pulse == (_RELEASE_HIGH if high else _RELEASE):
                self._release(channel)
            else:
                self._set(channel, min(max(pulse, _LEAST), _MOST), now)

    def _set(self, channel: int, pulse: int, now: float) -> None:
        self._pulses[channel] = pulse, now + self._autopilot.settings.pilot_timeout
        self._heard_at = now

    def _release(self, channel: int) -> None:
        """Give a channel back to the radio that we do not have: no longer a pilot's."""
        if self._pulses.pop(channel, None) and not self._pulses:
            self._heard_at = None

    def _pulse(self, channel: int) -> int | None:
        """Return a channel in us, None when nobody has it."""
        pulse, until = self._pulses.get(channel, (None, 0.0))
        return pulse if self._autopilot.now < until else None

    def _centred(self, channel: int) -> float:
        """Return a self-centring stick, -1..1."""
        pulse = self._pulse(channel)
        if pulse is None:
            return 0.0
        offset = (pulse - _TRIM) / (_HIGH - _TRIM)
        return _beyond_deadzone(min(max(offset, -1.0), 1.0))


def _beyond_deadzone(value: float) -> float:
    """Return a stick's deflection with the dead zone about its middle taken out."""
    size = abs(value) - _DEADZONE
    if size <= 0:
        return 0.0
    return size / (1 - _DEADZONE) * (1 if value > 0 else -1)
