"""`mavherd version`: what runs here, in one line."""

import argparse
import platform

from ... import __version__
from ..compiled import state


def run(args: argparse.Namespace) -> int:
    """Print version, whether the hot modules are compiled, and the machine; return 0."""
    python = f"{platform.python_implementation()} {platform.python_version()}"
    print(f"mavherd {__version__} ({state()}), {python}, {platform.platform()}")
    return 0
