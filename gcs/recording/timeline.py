"""What changes in steps: flight modes, phases of the mission, and the log of events."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...transport.wire import Phase, VehicleState
from ..mode_names import mode_name
from .stage import Stage, StagedRobot
from .stream import Stream, rgb

# From grey over blue to green, warm on the way home: light and dark differ where hues may not.
PHASE_COLOURS = {
    "waiting": "#5F6872",
    "starting": "#CC79A7",
    "ready": "#B4DEF6",
    "active": "#0072B2",
    "dwell": "#56B4E9",
    "returning": "#E69F00",
    "landing": "#D55E00",
    "done": "#009E73",
}
DISARMED = " · disarmed"
_MODE_COLOURS = {
    "GUIDED": "#0072B2",
    "OFFBOARD": "#0072B2",
    "LAND": "#D55E00",
    "AUTO.LAND": "#D55E00",
    "RTL": "#E69F00",
    "AUTO.RTL": "#E69F00",
    "SMART_RTL": "#E69F00",
    "BRAKE": "#F0E442",
    "HOLD": "#8C96A0",
    "AUTO.LOITER": "#8C96A0",
    "LOITER": "#8C96A0",
    "STABILIZE": "#CC79A7",
    "MANUAL": "#CC79A7",
    "AUTO": "#009E73",
    "AUTO.MISSION": "#009E73",
}
_DISARMED_COLOUR = "#3A424B"
_LEVELS = ("CRITICAL", "CRITICAL", "CRITICAL", "ERROR", "WARN", "INFO", "INFO", "DEBUG")
_KIND_LEVELS = {
    "problem": "ERROR",
    "collision": "ERROR",
    "preflight": "WARN",
    "link": "WARN",
    "phase": "DEBUG",
}


class Timeline:
    """Writes modes and phases where they change, and every event."""

    def __init__(self, stream: Stream, stage: Stage) -> None:
        import rerun as rr

        self._rr = rr
        self._stream = stream
        self._is_led = bool(stage.law)
        self._is_crowd = stage.crowded
        self._kinds: dict[str, str] = {}
        self._modes: dict[str, str] = {}
        self._seen: dict[str, tuple[int, bool, Phase]] = {}
        self._phases: dict[str, Phase] = {}
        self._events: list[tuple[float, str, str]] = []  # time, line and level
        for robot in stage.robots:
            self.add_robot(robot)

    def add_robot(self, robot: StagedRobot) -> None:
        """Make room for a robot."""
        self._kinds[robot.name] = robot.kind
        modes = dict(_MODE_COLOURS)
        modes |= {f"{mode}{DISARMED}": _DISARMED_COLOUR for mode in _MODE_COLOURS}
        self._paint(f"mode/{robot.name}", modes)
        if self._is_led:
            self._paint(f"phase/{robot.name}", PHASE_COLOURS)

    def add_states(self, states: Sequence[VehicleState]) -> None:
        """Record modes and phases where they changed."""
        for state in states:
            now = (state.custom_mode, state.armed, state.phase)
            if self._seen.get(state.name) != now and state.name in self._kinds:
                self._seen[state.name] = now
                self._change(state)

    def _change(self, state: VehicleState) -> None:
        name, kind = state.name, self._kinds[state.name]
        if kind in ("quadcopter", "rover"):
            mode = mode_name(kind, state.custom_mode)
            self.add_mode(name, state.time, mode + ("" if state.armed else DISARMED))
        if self._is_led and self._phases.get(name) != state.phase:
            self._phases[name] = state.phase
            change = self._rr.StateChange(state=state.phase.name.lower())
            self._stream.log(f"phase/{name}", state.time, change)

    def add_mode(self, name: str, time: float, mode: str) -> None:
        """Record a mode in words if it is another than before."""
        if self._modes.get(name) != mode:
            self._modes[name] = mode
            self._stream.log(f"mode/{name}", time, self._rr.StateChange(state=mode))

    def add_event(self, event: Mapping[str, Any]) -> None:
        """Keep one line of the event log: whose it is, of which kind, and what it says.

        Phases of a crowd would hide all else: they are seen beside the log.
        """
        vehicle, kind, text = event.get("vehicle"), event["kind"], event["text"]
        if kind == "phase" and self._is_crowd:
            return
        line = f"{vehicle}: {text}" if vehicle else str(text)
        if kind == "phase" and vehicle:
            line = f"{vehicle} → {text}"
        elif kind != "text":
            line = f"{line}  [{kind}]"
        self._events.append((float(event["t"]), line, _level(event)))

    def flush(self) -> None:
        """Record the events that were kept."""
        if self._events:
            time, lines, levels = zip(*self._events, strict=True)
            self._events.clear()
            columns = self._rr.TextLog.columns(text=lines, level=levels)
            self._stream.columns("events", np.array(time), columns)

    def _paint(self, entity: str, colours: Mapping[str, str]) -> None:
        paint = [rgb(colour) for colour in colours.values()]
        look = self._rr.StateConfiguration(values=list(colours), colors=paint)
        self._stream.static(entity, look)


def _level(event: Mapping[str, Any]) -> str:
    """Return the level of an event: its severity as MAVLink has it, else that of its kind."""
    severity = event.get("severity")
    if isinstance(severity, int) and 0 <= severity < len(_LEVELS):
        return _LEVELS[severity]
    return _KIND_LEVELS.get(event["kind"], "INFO")
