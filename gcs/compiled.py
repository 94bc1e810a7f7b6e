"""Which modules are compiled ahead of time where a C compiler is there, and which are so now.

They hold what runs every tick. Compiled or not, they compute the same bytes; see
docs/performance.md. `setup.py` reads `HOT`.
"""

import sys
from collections.abc import Iterator
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
"""Paths below the package, without `.py`; `*` is every module of a folder."""


def sources(package: Path) -> Iterator[Path]:
    """Yield the source file of every hot module below the folder `package`."""
    for pattern in HOT:
        yield from sorted(p for p in package.glob(f"{pattern}.py") if p.name != "__init__.py")


def state() -> str:
    """Return how this program runs, for people: `compiled`, `pure Python`, or what is wrong."""
    package = Path(__file__).parent.parent
    modules = list(sources(package))
    loaded = [_loaded_from(package, source) for source in modules]
    compiled = [(s, file) for s, file in zip(modules, loaded, strict=True) if file.suffix != ".py"]
    if not compiled:
        return "pure Python"
    stale = [s for s, file in compiled if s.stat().st_mtime > file.stat().st_mtime]
    if stale or len(compiled) < len(modules):
        changed = stale or [s for s, file in zip(modules, loaded, strict=True) if file == s]
        name = changed[0].relative_to(package)
        return f"compiled, but {name} has changed since: run make compiled or make pure"
    return "compiled"


def _loaded_from(package: Path, source: Path) -> Path:
    """Return the file that an import of the module at `source` takes."""
    name = ".".join(("mavherd", *source.relative_to(package).with_suffix("").parts))
    module = sys.modules.get(name)
    spec = getattr(module, "__spec__", None) or find_spec(name)
    return Path(spec.origin) if spec and spec.origin else source
