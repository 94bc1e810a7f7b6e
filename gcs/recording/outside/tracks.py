"""The track of an outside vehicle, in the form and at the rate of a truth log.

Between what it tells its positions and attitudes are interpolated. How fast its motors turn it
does not tell: rotors are shown to turn as the outputs of its servos say, wheels as its speed does.
"""

import numpy as np

from ....transport.frames import Origin, Triple
from ....vehicles.rover import RoverParams
from ...report.truth import Floats, Track
from .place import to_enu
from .series import LONGEST_S, Series, grid, turns
from .vehicle import SeenVehicle

PATIENCE_S = 5.0  # with the only vehicle, when it has not told where it is,
PATIENCE_OF_MANY_S = 60.0  # and with one of several, which would be drawn in one place
FULL_RAD_S = 900.0  # of a rotor whose output is at its upper end
_MOST_SPOTS = 300  # kept of a vehicle that cannot be placed yet
_TOGETHER_S = 1.0  # an attitude this much older than a position is that of its moment
_KEPT_S = 2 * LONGEST_S  # of what was told last: what is older is joined to nothing new
_ROTORS = (2, 0, 3, 1)  # which of ArduPilot's outputs turn front, right, rear and left rotor
_QUADCOPTER = tuple(f"rotor{i}_speed_rad_s" for i in range(1, 5))
_ROVER = ("left_wheel_speed_rad_s", "right_wheel_speed_rad_s")
_COLUMNS = {"quadcopter": _QUADCOPTER, "rover": _ROVER}


class TrackMaker:
    """Makes tracks of what a vehicle tells, each beginning where the last one ended."""

    def __init__(self, vehicle: SeenVehicle) -> None:
        self._vehicle = vehicle
        self._positions = Series(3)
        self._low, self._high = np.full(3, np.nan), np.full(3, np.nan)
        self._done = vehicle.first_at
        self._rover = RoverParams()

    @property
    def place(self) -> Triple | None:
        """Return where the vehicle was told to be last."""
        last = self._positions.last
        return (last[0], last[1], last[2]) if last else None

    @property
    def corners(self) -> tuple[Triple, ...]:
        """Return two opposite corners of the box that it was in; none if it was nowhere."""
        if np.isnan(self._low).any():
            return ()
        low, high = self._low.tolist(), self._high.tolist()
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])

    def locate(self, shared: Origin | None, *, late: bool) -> None:
        """Bring what was told into the shared frame, as soon as that can be done, or must."""
        v = self._vehicle
        own = v.frame.origin
        if not late and (shared is None or (own is None and any(s.local for _, s in v.spots))):
            del v.spots[:-_MOST_SPOTS]
            return
        for time, spot in v.spots:
            if place := to_enu(spot, own, shared):
                self._positions.add(time, place)
                self._low = np.fmin(self._low, place)
                self._high = np.fmax(self._high, place)
        v.spots.clear()

    def take(self, *, everything: bool = False) -> Track | None:
        """Return what is new; None: nothing.

        A vehicle that tells its attitude, but no position any more, stands still where it was last;
        one that has told none is at 0, 0, 0.
        """
        v = self._vehicle
        position_at, attitude_at = self._positions.newest, v.attitudes.newest
        if attitude_at - position_at > LONGEST_S:
            until, told = attitude_at, v.attitudes
        else:
            until, told = position_at, self._positions
            if attitude_at > position_at - _TOGETHER_S and not everything:
                until = min(position_at, attitude_at)
        track = None
        if until > self._done:
            time = grid(self._done, until)
            self._done = until
            time = time[told.covers(time)]
            track = self._track(time) if len(time) else None
        self._forget()
        return track

    def _forget(self) -> None:
        """Keep no more than new tracks may need, whatever the vehicle tells and does not tell."""
        v = self._vehicle
        kept = self._positions, v.velocities, v.attitudes, v.rates, v.servos
        before = max(self._done, max(series.newest for series in kept) - _KEPT_S)
        for series in kept:
            series.forget(before)

    def _track(self, time: Floats) -> Track:
        v = self._vehicle
        velocity, quaternion, rates = (
            v.velocities.at(time),
            turns(v.attitudes, time),
            v.rates.at(time),
        )
        velocity[time > self._positions.newest] = 0.0
        names = _COLUMNS.get(v.kind, ())
        actuators = np.empty((len(time), 0))
        if names is _QUADCOPTER:
            actuators = v.servos.at(time)[:, _ROTORS] * FULL_RAD_S
        elif names is _ROVER:
            actuators = self._wheels(velocity, quaternion, rates)
        return Track(
            name=v.name,
            kind=v.kind,
            system_id=v.system_id,
            columns=(),
            time=time,
            position=self._positions.at(time),
            velocity=velocity,
            quaternion=quaternion,
            rates=rates,
            actuators=actuators,
            actuator_names=names,
            source="telemetry",
        )

    def _wheels(self, velocity: Floats, quaternion: Floats, rates: Floats) -> Floats:
        w, x, y, z = quaternion.T
        ahead = np.column_stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z)])
        speed = np.sum(velocity[:, :2] * ahead, axis=1)
        turn = rates[:, 2] * self._rover.half_track
        return np.column_stack([speed - turn, speed + turn]) / self._rover.wheel_radius
