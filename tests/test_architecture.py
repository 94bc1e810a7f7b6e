"""Imports point one way, and heavy or unruly packages stay where they belong."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("transport", "vehicles", "scenarios", "gcs")
MAY_IMPORT = {
    "transport": set(),
    "vehicles": {"transport"},
    "scenarios": {"transport", "vehicles"},
    "gcs": {"transport", "vehicles", "scenarios"},
}
ONLY_IN = {
    "pymavlink": ("transport/dialect.py",),
    "zenoh": ("transport/bus.py",),
    "serial": ("transport/serial_line.py",),
    "rerun": ("gcs/recording/", "gcs/run/live_view"),
    "yaml": ("scenarios/", "gcs/"),
}
HEAVY = {"numpy", "scipy", "matplotlib", "pyarrow", "rerun", "rich"}
PHYSICS = (
    *("quadcopter", "rover", "physics", "mixer", "pid", "quadcopter_control", "rover_control"),
    *("quadcopter_tuning", "attitude_control"),
)
PHYSICS_MAY_IMPORT = {"math", "typing", "dataclasses", "collections.abc", "functools"}
SANS_IO = (
    *(
        f"transport/{name}"
        for name in ("mavlink", "dialect", "form", "extra_messages", "frames", "wire")
    ),
    *(f"gcs/team/{name}" for name in ("mission", "starter", "coordinator", "member")),
    *(f"gcs/team/{name}" for name in ("setpoints", "fence")),
    *(f"vehicles/{name}" for name in ("vehicle", "lockstep", "routing", "attention")),
)
SANS_IO_FOLDERS = (
    *(f"vehicles/{name}" for name in ("flight", "missions", "parameters", "protocol")),
    *("gcs/station", "gcs/laws", "gcs/safety"),
)
READS_FILES = ("vehicles/missions/files", "vehicles/parameters/files")
MODULES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
MAX_LINES = 350


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def imports(path: Path) -> frozenset[str]:
    """Return the dotted name of everything a module imports, our own as `mavherd...`."""
    return frozenset(_imports(path))


def _imports(path: Path) -> Iterator[str]:
    here = ("mavherd", *path.relative_to(ROOT).with_suffix("").parts)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parents = here[: len(here) - node.level] if node.level else ()
            base = ".".join((*parents, *filter(None, [node.module])))
            yield base
            yield from (f"{base}.{alias.name}" for alias in node.names)


def test_there_is_something_to_look_at():
    assert {relative(p).partition("/")[0] for p in MODULES} == set(PACKAGES)
    assert "mavherd.transport.links" in set(imports(ROOT / "vehicles/process.py"))


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_point_one_way(package):
    allowed = MAY_IMPORT[package] | {package, "__version__"}
    for path in (ROOT / package).rglob("*.py"):
        for name in imports(path):
            root, _, rest = name.partition(".")
            assert root not in PACKAGES, f"{relative(path)} imports {name} without mavherd."
            if root == "mavherd" and rest:
                assert rest.partition(".")[0] in allowed, f"{relative(path)} imports {name}"


@pytest.mark.parametrize("package", sorted(ONLY_IN))
def test_a_foreign_package_has_one_door(package):
    users = {relative(p) for p in MODULES if any(n.split(".")[0] == package for n in imports(p))}
    strangers = {user for user in users if not user.startswith(ONLY_IN[package])}
    assert not strangers


def test_only_the_generated_dialect_of_pymavlink_is_used():
    names = {n for n in imports(ROOT / "transport/dialect.py") if n.startswith("pymavlink")}
    assert names
    assert all(name.startswith("pymavlink.dialects.v20") for name in names)
    assert not any("mavutil" in name for path in MODULES for name in imports(path))


def test_a_vehicle_imports_nothing_heavy():
    for package in ("transport", "vehicles"):
        for path in (ROOT / package).rglob("*.py"):
            heavy = {name.partition(".")[0] for name in imports(path)} & HEAVY
            assert not heavy, f"{relative(path)} imports {heavy}"
    assert not any(
        name.startswith("mavherd.transport.bus")
        for path in (ROOT / "vehicles").rglob("*.py")
        for name in imports(path)
    ), "a vehicle knows no Zenoh"


@pytest.mark.parametrize("name", PHYSICS)
def test_physics_is_arithmetic(name):
    for imported in imports(ROOT / "vehicles" / f"{name}.py"):
        if imported.startswith("mavherd.vehicles"):
            continue
        assert any(imported == ok or imported.startswith(f"{ok}.") for ok in PHYSICS_MAY_IMPORT), (
            f"{name} imports {imported}"
        )


def test_sans_io_modules_know_no_sockets_and_no_clock():
    folders = [path for f in SANS_IO_FOLDERS for path in (ROOT / f).rglob("*.py")]
    assert len(folders) > len(SANS_IO_FOLDERS)
    modules = {relative(path).removesuffix(".py") for path in folders} - set(READS_FILES)
    for module in sorted(modules.union(SANS_IO)):
        forbidden = {"socket", "time", "select", "threading", "os", "random", "pathlib"}
        used = set(imports(ROOT / f"{module}.py")) & forbidden
        assert not used, f"{module} imports {used}"


def test_a_long_module_is_asking_to_be_two():
    long = {relative(p): n for p in MODULES if (n := len(p.read_text().splitlines())) > MAX_LINES}
    assert set(long) <= {"gcs/cli.py"}, long
