"""Compiled ahead of time or not: the same bytes. Builds a copy of the tree, as `make compiled`."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from mavherd.gcs.compiled import sources

ROOT = Path(__file__).parents[2]
BUILT_FROM = ("src", "transport", "vehicles", "scenarios", "gcs", "setup.py", "pyproject.toml")
NO_PORTS = ("--gcs-udp", "0", "--api-udp", "0", "--tcp", "0")

pytestmark = [
    pytest.mark.timeout(900),
    pytest.mark.skipif(not shutil.which(os.environ.get("CC", "cc")), reason="no C compiler"),
]


def mavherd(source, folder, *args):
    done = subprocess.run(
        [sys.executable, "-m", "mavherd", *args],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(source)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def trees(tmp_path_factory):
    """Two copies of the source: one pure, one compiled."""
    folder = tmp_path_factory.mktemp("trees")
    for tree in ("pure", "compiled"):
        for name in BUILT_FROM:
            source, target = ROOT / name, folder / tree / name
            ignored = shutil.ignore_patterns("*.so", "__pycache__", "*.egg-info")
            if source.is_dir():
                shutil.copytree(source, target, symlinks=True, ignore=ignored)
            else:
                target.parent.mkdir(exist_ok=True)
                shutil.copy(source, target)
    build = [sys.executable, "setup.py", "--quiet", "build_ext", "--inplace"]
    done = subprocess.run(build, cwd=folder / "compiled", capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return {tree: folder / tree / "src" for tree in ("pure", "compiled")}


@pytest.mark.parametrize("tree", ["pure", "compiled"])
def test_the_program_says_which_it_is(trees, tmp_path, tree):
    said = mavherd(trees[tree], tmp_path, "version")
    assert {"pure": "(pure Python)", "compiled": "(compiled)"}[tree] in said


def test_a_source_that_has_changed_since_is_told(trees, tmp_path):
    hot = trees["compiled"] / "mavherd" / "transport" / "frames.py"
    before = hot.stat()
    os.utime(hot)
    try:
        said = mavherd(trees["compiled"], tmp_path, "version")
    finally:
        os.utime(hot, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert "transport/frames.py has changed since: run make compiled or make pure" in said


def test_every_hot_module_is_there():
    missing = [path for path in sources(ROOT) if not path.exists()]
    assert missing == []


def test_where_it_is_installed_the_dates_of_files_mean_nothing(trees, tmp_path):
    installed = tmp_path / "site-packages"
    shutil.copytree(trees["compiled"], installed)  # follows the links to the four folders
    for source in sources(installed / "mavherd"):
        os.utime(source)
    assert "(compiled)" in mavherd(installed, tmp_path, "version")


@pytest.mark.parametrize(
    "options",
    [
        ("crossing-targets",),
        ("tracking", "--seed", "2", "--set", "disturbance=held", "--autopilot", "px4"),
    ],
)
def test_both_compute_the_same_bytes(trees, tmp_path, options):
    digests = {}
    for tree, source in trees.items():
        folder = tmp_path / tree
        folder.mkdir()
        args = ("run", *options, *NO_PORTS, "--no-record", "--json")
        report = json.loads(mavherd(source, folder, *args))
        assert report["compiled"] == {"pure": "pure Python", "compiled": "compiled"}[tree]
        digests[tree] = report["digest"]
    assert digests["pure"] == digests["compiled"]
