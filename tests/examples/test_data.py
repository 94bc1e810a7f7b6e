"""examples/09_data.py: every package that it knows reads what a run has left."""

import subprocess
import sys
from importlib.util import find_spec

import pytest

from .conftest import EXAMPLES


@pytest.mark.timeout(400)
@pytest.mark.skipif(find_spec("rerun") is None, reason="needs the view extra")
def test_each_package_says_something_of_the_run(tmp_path):
    done = subprocess.run(
        [sys.executable, EXAMPLES / "09_data.py"],
        cwd=tmp_path,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        timeout=300,
        check=True,
    )
    told = done.stdout
    assert "law safe" in told
    for package, signs in {
        "pandas": ("highest_m", "returning"),
        "polars": ("roll_error_deg",),
        "datafusion": ("Transform3D:translation",),
    }.items():
        if find_spec(package):
            assert all(sign in told for sign in signs)
        else:
            assert "is left out" in told
