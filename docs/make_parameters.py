"""Write docs/parameters.md: every parameter of every vehicle, from the tables in the code.

python docs/make_parameters.py
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from markdown import KINDS, NONE, table, vehicle

from mavherd.vehicles.config import PROFILES
from mavherd.vehicles.parameters.parameter import Parameter
from mavherd.vehicles.parameters.profile import numbers
from mavherd.vehicles.parameters.tables import table as parameters_of

PAGE = Path(__file__).parent / "parameters.md"
STACKS = {"ardupilot": "ArduPilot", "px4": "PX4"}

_INTRODUCTION = """\
# Parameters

Made by `make docs` from the tables that the code itself goes by; a test compares the two. How to
set and keep parameters is told in [vehicles.md](vehicles.md).

Every name means what it means on the real flight stack, in its unit; defaults are those of
`mavherd vehicle` (profile `ardupilot`). A name that begins with HERD_ is ours. What is missing here
does not exist: reading it is met with silence, as by ArduPilot. A value out of its range is
refused. Personality `generic` has ArduPilot's parameters.

`n` stands for a number: RCn_MIN (1-8) is RC1_MIN to RC8_MIN. *Reboot*: counts from the next boot
on; all others count at once."""

_OURS = """\
The same constants and gains under our own names, in SI units, as `--param` and `params:` in a
scenario take them too. A value more than 100 times larger or smaller than the usual one is
refused. Values of the profiles `paper` (the paper's Table 2) and `ardupilot` are shown where they
differ from `default`. An attitude gain is an angular acceleration per angle (1/s²), in profile
`paper` a torque per angle (N m)."""

_LAST = ("SIM", "HERD")
_UNITS = {
    "mass": "kg",
    "inertia": "kg m², about the centre of gravity",
    "inertia_x": "kg m², body axes",
    "inertia_y": "kg m²",
    "inertia_z": "kg m²; Table 1 prints a tenth of it, which no flat machine can have",
    "rotor_inertia": "kg m², motor and propeller about the shaft",
    "arm_length": "m, shaft to centre of gravity",
    "thrust_coefficient": "N s²: thrust over speed squared",
    "torque_per_thrust": "m: propeller drag torque over thrust, k_Q / k",
    "max_rotor_speed": "rad/s",
    "motor_lag": "s, time constant of a motor's speed servo",
    "roll_p": "1/s²; N m/rad in `paper`; pitch uses the same",
    "roll_d": "1/s; N m s/rad in `paper`",
    "yaw_p": "as roll",
    "yaw_i": "per second more",
    "yaw_d": "as roll",
    "altitude_p": "1/s²",
    "altitude_i": "1/s³",
    "altitude_d": "1/s",
    "altitude_i_limit": "m/s², the integral's share",
    "position_p": "1/s²; 1/s of a rover",
    "position_d": "1/s",
    "v_max": "m/s, horizontal",
    "v_up_max": "m/s",
    "v_down_max": "m/s",
    "accel_max": "m/s², 0: what tilt or wheels give",
    "climb_accel_max": "m/s², 0: what the rotors give",
    "spool_time": "s from idle to lift-off",
    "tilt_limit": "rad",
    "yaw_rate_max": "rad/s",
    "wheel_radius": "m",
    "half_track": "m, from point B to each wheel",
    "cg_offset": "m, from point B forward to the centre of gravity",
    "drag_linear": "N s/m",
    "drag_angular": "N m s/rad",
    "torque_limit": "N m, at each wheel",
    "heading_p": "1/s",
    "wheel_p": "N m s/rad",
    "wheel_i": "N m/rad",
    "wheel_speed_max": "rad/s",
    "arrival_radius": "m: this near to a fixed position it stands",
}


@dataclass
class Family:
    """Parameters that differ only by a number in their names, of copter and rover."""

    name: str
    first: Parameter
    numbers: set[int] = field(default_factory=set)
    defaults: dict[str, list[str]] = field(default_factory=dict)  # by kind

    @property
    def shown(self) -> str:
        """Return the name as people read it."""
        if len(self.numbers) < 2:
            return self.first.name
        n = sorted(self.numbers)
        whole = n == list(range(n[0], n[-1] + 1))
        return f"{self.name} ({f'{n[0]}-{n[-1]}' if whole else ', '.join(map(str, n))})"

    def default(self, kind: str) -> str:
        """Return the default, or the defaults."""
        return ", ".join(dict.fromkeys(self.defaults.get(kind, [NONE])))


def page() -> str:
    """Return the whole page."""
    parts = [_INTRODUCTION]
    for stack, title in STACKS.items():
        families = _families(stack)
        used = [f for f in families if not (f.first.is_kept_only or f.first.read_only)]
        kept = [f for f in families if f.first.is_kept_only]
        facts = [f for f in families if f.first.read_only]
        parts.append(f"## {title}: what counts")
        for group in sorted(dict.fromkeys(map(_title, used)), key=_LAST.__contains__):
            parts.append(f"### {group}\n\n{_table(f for f in used if _title(f) == group)}")
        parts.append(
            f"## {title}: kept for ground stations\n\nThey can be set, are checked and kept, and"
            f" change nothing.\n\n{_table(kept)}"
        )
        parts.append(
            f"## {title}: facts\n\nRead-only, because they say how this vehicle is, or because it"
            f" writes them itself.\n\n{_table(facts)}"
        )
    parts.append(f"## Our own names, in SI units\n\n{_OURS}")
    parts += [f"### {shown.capitalize()}\n\n{_ours(kind)}" for kind, shown in KINDS.items()]
    return "\n\n".join(parts) + "\n"


def _families(stack: str) -> list[Family]:
    """Return the parameters of both kinds of vehicle, those that are alike together."""
    found: dict[tuple[object, ...], Family] = {}
    for kind in KINDS:
        for _, p, _, default in vehicle(kind, stack).parameters:
            labels = tuple(p.values.items()), tuple(p.bits.items())
            name = _with_n(p.name, count=1)
            key = name, _with_n(p.text), p.unit, _with_n(p.path), *labels
            family = found.setdefault(key, Family(name, p))
            family.numbers.update(map(int, re.findall(r"\d+", p.name)[:1]))
            shown = str(int(default)) if p.is_integer else f"{default:g}"
            family.defaults.setdefault(kind, []).append(shown)
    return list(found.values())


def _with_n(text: str, count: int = 0) -> str:
    return re.sub(r"\d+", "n", text, count=count)


def _title(family: Family) -> str:
    group = family.first.group
    return _with_n(group) if len(family.numbers) > 1 else group


def _table(families: Iterable[Family]) -> str:
    rows = [(f.shown, *map(f.default, KINDS), f.first.unit, _about(f)) for f in families]
    return table(("name", *KINDS.values(), "unit", "what it is"), rows)


def _about(family: Family) -> str:
    """Return what a parameter is, and what its values mean."""
    p = family.first
    remarks = [f"{value} {label}" for value, label in p.values.items() if not p.is_kept_only]
    remarks += [f"bit {bit} {label}" for bit, label in p.bits.items()]
    remarks += ["*reboot*"] if p.reboot else []
    text = _with_n(p.text) if len(family.numbers) > 1 else p.text
    return text + (f" ({'; '.join(remarks)})" if remarks else "")


def _ours(kind: str) -> str:
    values = {profile: numbers(kind, profile) for profile in PROFILES}
    names = {stack: dict(_robot_names(stack, kind)) for stack in STACKS}
    usual = values.pop("default")
    rows = []
    for name, value in usual.items():
        others = [f"{v[name]:g}" if v[name] != value else "" for v in values.values()]
        theirs = [names[stack][name] for stack in STACKS]
        rows.append((f"`{name}`", f"{value:g}", *others, _UNITS[name], *theirs))
    return table(("name", "default", *values, "", *STACKS.values()), rows)


def _robot_names(stack: str, kind: str) -> Iterator[tuple[str, str]]:
    for p in parameters_of(stack, kind, "ardupilot"):
        if p.is_robots:
            yield p.robot_name, p.name


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
