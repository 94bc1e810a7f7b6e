"""A run's recording, made afterwards from what the run has left: truth, events and links.

It holds what the recorder would have recorded, but for what nobody wrote down: how a law's push
differed from the robot's own way, how fast the run went, and where external vehicles, whose links
speak of frames of their own, were believed to be.
"""

from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from ...scenarios.paths import reference
from ...scenarios.schema import RobotSpec, Team
from ...transport.errors import MavherdError
from ...transport.frames import Triple, quaternion_to_enu, swap_ned_enu
from ...transport.mavlink import AUTOPILOT_COMPONENT, Codec, Message, mav
from ...transport.tlog import read_tlog
from ...transport.wire import Phase, Target, VehicleState
from ...vehicles.config import SIMULATED_EPOCH_US
from ..flown.flown import Flown, open_flown
from ..patience import Bar
from ..report.truth import Track
from ..station.status import VehicleStatus
from .layout import layout
from .outside.convert import Converted
from .scene import Scene
from .stage import stage_of
from .stream import Stream

FINE = 2  # rows of the 100 Hz truth that become one
_SLICE_S = 5.0  # recorded at a time
_PERIOD_S = 0.1  # between two states or targets
_DAY_US = 86_400_000_000
_NAN: Triple = (float("nan"),) * 3


class Told(NamedTuple):
    """What a robot's link holds."""

    states: list[VehicleState]
    targets: list[Target]


def convert_run(folder: Path, output: Path, bar: Bar) -> Converted:
    """Write the recording of the run in `folder`.

    Raises MavherdError when no run has left it, or nothing of how its robots moved.
    """
    flown = open_flown(folder)
    if flown.goes_on():
        raise MavherdError(f"{folder}: the run goes on (wait for its end)")
    tracks = flown.tracks()
    if not tracks:
        raise MavherdError(f"{folder}: nothing tells how its robots moved (no truth.bin)")
    events = flown.events()
    told = {spec.name: _told(flown, spec, events) for spec in flown.starts}
    stream = Stream(str((flown.report or {}).get("run_id") or folder.name), file=output)
    scene = Scene(stream, stage_of(flown.scenario), lay_out=partial(layout, afterwards=True))
    try:
        end = max(float(track.time[-1]) for track in tracks)
        for event in events:
            scene.add_event(event)
        begin = 0.0
        while begin <= end:
            until = begin + _SLICE_S
            for track in tracks:
                if len(piece := _slice(track, begin, until)):
                    scene.add_truth(piece)
            _add_told(scene, told, begin, until)
            scene.flush()
            begin = until
            bar.reach(min(1.0, begin / end) if end else 1.0)
        scene.flush(everything=True)
    finally:
        stream.close()
    remarks = [f"{folder}: {text}" for text in flown.missing if "run.rrd" not in text]
    return Converted([track.name for track in tracks], end, remarks)


def _slice(track: Track, begin: float, until: float) -> Track:
    first, last = (bisect_left(track.time, moment) for moment in (begin, until))
    first += -first % FINE
    rows = slice(first, last, FINE)
    commands = track.commands[rows] if len(track.commands) else track.commands
    return replace(
        track,
        time=track.time[rows],
        position=track.position[rows],
        velocity=track.velocity[rows],
        quaternion=track.quaternion[rows],
        rates=track.rates[rows],
        actuators=track.actuators[rows],
        commands=commands,
    )


def _add_told(scene: Scene, told: dict[str, Told], begin: float, until: float) -> None:
    """Record states and targets of a slice of time, those of one tick together."""
    states: dict[int, list[VehicleState]] = {}
    for one in told.values():
        scene.add_targets([t for t in one.targets if begin <= t.time < until])
        for state in one.states:
            if begin <= state.time < until:
                states.setdefault(state.sequence, []).append(state)
    for tick in sorted(states):
        scene.add_states(states[tick], tick * _PERIOD_S)


def _told(flown: Flown, spec: RobotSpec, events: Sequence[Mapping[str, Any]]) -> Told:
    """Return what a robot's link tells, at 10 Hz."""
    log = flown.tlog(spec.name)
    if log is None or spec.external:
        return Told([], [])
    phases = [
        (float(e["t"]), Phase[str(e["text"]).upper()])
        for e in events
        if e["vehicle"] == spec.name and e["kind"] == "phase"
    ]
    return _Reader(spec, flown.scenario.team, phases).read(_messages(log))


def _messages(log: Path) -> Iterator[tuple[float, Message]]:
    """Yield fleet time and message of a link's log; damage ends it."""
    codec, epoch = Codec(0), None
    try:
        for time_us, frame in read_tlog(log):
            if epoch is None:
                conducted = 0 <= time_us - SIMULATED_EPOCH_US < _DAY_US
                epoch = SIMULATED_EPOCH_US if conducted else time_us
            for message in codec.decode(frame, stream=False):
                yield (time_us - epoch) * 1e-6, message
    except MavherdError:
        return


class _Reader:
    """Reads one robot's link as its coordinator did."""

    def __init__(self, spec: RobotSpec, team: Team, phases: list[tuple[float, Phase]]) -> None:
        self._spec = spec
        self._team = team
        self._phases = phases
        self._began_at = next((t for t, phase in phases if phase is Phase.ACTIVE), None)
        self._status = VehicleStatus()
        self._phase = Phase.WAITING
        self._told = Told([], [])
        self._state_due = self._target_due = 0.0

    def read(self, messages: Iterator[tuple[float, Message]]) -> Told:
        """Return states and targets."""
        for now, m in messages:
            while self._phases and self._phases[0][0] <= now + 1e-6:
                self._phase = self._phases.pop(0)[1]
            if m.get_srcSystem() == self._spec.system_id:
                if m.get_srcComponent() == AUTOPILOT_COMPONENT:
                    self._hear(m, now)
            elif m.get_type() == "SET_POSITION_TARGET_LOCAL_NED" and now >= self._target_due:
                self._target_due = now + _PERIOD_S - 1e-3
                self._want(m, now)
        return self._told

    def _hear(self, m: Message, now: float) -> None:
        s = self._status
        s.hear(m, now)
        if m.get_type() != "LOCAL_POSITION_NED" or now < self._state_due:
            return
        self._state_due = now + _PERIOD_S - 1e-3
        state = VehicleState(
            self._spec.name,
            self._spec.system_id,
            round(now / _PERIOD_S),
            m.time_boot_ms * 1e-3,
            swap_ned_enu((m.x, m.y, m.z)),
            swap_ned_enu((m.vx, m.vy, m.vz)),
            quaternion_to_enu(s.quaternion),
            s.custom_mode,
            s.armed,
            self._phase,
        )
        self._told.states.append(state)

    def _want(self, m: Message, now: float) -> None:
        velocity = _NAN
        if m.coordinate_frame == mav.MAV_FRAME_LOCAL_NED and not m.type_mask & 0x038:
            velocity = swap_ned_enu((m.vx, m.vy, m.vz))
        place, pace = _NAN, _NAN
        if self._phase in (Phase.ACTIVE, Phase.DWELL) and self._began_at is not None:
            wanted = reference(self._spec.path, self._spec, self._team, now - self._began_at)
            place, pace = wanted.position, wanted.velocity
        self._told.targets.append(Target(self._spec.name, now, place, pace, velocity, _NAN))
