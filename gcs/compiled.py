"""Which modules are compiled ahead of time where a C compiler is there, and which are so now.

They hold what runs every tick. Compiled or not, they compute the same bytes; see
docs/performance.md. `setup.py` reads `HOT`.
"""

import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path

HOT = (
    "gcs/laws/approach",
    "gcs/laws/base",
    "gcs/laws/off",
    "gcs/laws/paper",
    "gcs/laws/safe",
    "gcs/station/commands",
    "gcs/station/missions",
    "gcs/station/parameters",
    "gcs/station/station",
    "gcs/station/status",
    "gcs/station/streams",
    "gcs/station/targets",
    "gcs/safety/takeover",
    "gcs/team/coordinator",
    "gcs/team/exchange",
    "gcs/team/member",
    "gcs/team/mission",
    "gcs/team/neighbours",
    "gcs/team/seat",
    "gcs/team/setpoints",
    "scenarios/route",
    "transport/form",
    "transport/frames",
    "transport/mavlink",
    "transport/wire",
    "vehicles/attitude_control",
    "vehicles/disturbance",
    "vehicles/flight/arming",
    "vehicles/flight/attitude_target",
    "vehicles/flight/autopilot",
    "vehicles/flight/avoidance",
    "vehicles/flight/battery",
    "vehicles/flight/behaviour",
    "vehicles/flight/failsafe",
    "vehicles/flight/fence",
    "vehicles/flight/gaze",
    "vehicles/flight/guided",
    "vehicles/flight/position_target",
    "vehicles/flight/settings",
    "vehicles/flight/targets",
    "vehicles/lockstep",
    "vehicles/mixer",
    "vehicles/physics",
    "vehicles/pid",
    "vehicles/protocol/conversation",
    "vehicles/protocol/rates",
    "vehicles/protocol/steering",
    "vehicles/protocol/streams",
    "vehicles/protocol/telemetry/motion",
    "vehicles/protocol/telemetry/telemetry",
    "vehicles/protocol/telemetry/view",
    "vehicles/quadcopter",
    "vehicles/quadcopter_control",
    "vehicles/quadcopter_robot",
    "vehicles/robot",
    "vehicles/rover",
    "vehicles/rover_control",
    "vehicles/rover_robot",
    "vehicles/truth",
    "vehicles/vehicle",
)
"""Paths below the package, without `.py`."""


def sources(package: Path) -> list[Path]:
    """Return the source file of every hot module below the folder `package`."""
    return [package / f"{name}.py" for name in HOT]


@cache
def state() -> str:
    """Return how this program runs, for people: `compiled`, `pure Python`, or what is wrong."""
    package = Path(__file__).parent.parent
    loaded = {source: _loaded_from(package, source) for source in sources(package)}
    pure = [source for source, file in loaded.items() if file.suffix == ".py"]
    if len(pure) == len(loaded):
        return "pure Python"
    changed = pure
    if _is_source_tree(package):
        changed = changed + [s for s, file in loaded.items() if _time(s) > _time(file)]
    if changed:
        name = changed[0].relative_to(package)
        return f"compiled, but {name} has changed since: run make compiled or make pure"
    return "compiled"


def _is_source_tree(package: Path) -> bool:
    """Return whether sources may have been edited: an installer dates files as it likes."""
    return (package.parent.parent / "setup.py").exists()


def _time(file: Path) -> float:
    return file.stat().st_mtime


def _loaded_from(package: Path, source: Path) -> Path:
    """Return the file that an import of the module at `source` takes."""
    name = ".".join(("mavherd", *source.relative_to(package).with_suffix("").parts))
    module = sys.modules.get(name)
    spec = getattr(module, "__spec__", None) or find_spec(name)
    return Path(spec.origin) if spec and spec.origin else source
