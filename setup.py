"""Compiles the hot modules with mypyc where that can be done; all else is in pyproject.toml.

`pip install .` compiles when there is a C compiler and falls back to pure Python with a note. An
editable install stays pure, since edits must count; `make compiled` compiles in place, `make pure`
takes that back. MAVHERD_COMPILE=0 never compiles; 1 fails where it cannot.
"""

import os
import runpy
import sys
import tempfile
from pathlib import Path
from typing import Any

from setuptools import setup
from setuptools.command.build_ext import build_ext

CHOICE = os.environ.get("MAVHERD_COMPILE", "")
WANTED = CHOICE != "0" and not {"bdist_wheel", "build_ext", "install"}.isdisjoint(sys.argv)
# An expression must not be rounded once where it is rounded twice elsewhere: same bytes.
FLAGS = ["-ffp-contract=off"]


class CannotCompileError(Exception):
    """Why the hot modules stay pure Python."""


class BuildHot(build_ext):
    """Builds all hot modules or none: half of them would not find the others."""

    def run(self) -> None:
        """Build; on failure go on without, unless compilation was asked for."""
        try:
            super().run()
        except Exception as error:
            if CHOICE == "1" or self.inplace:
                raise
            note(error)
            for path in self.get_outputs():
                Path(path).unlink(missing_ok=True)
            self.extensions = []


def hot_extensions() -> list[Any]:
    """Return the extension modules; raise CannotCompileError without compiler or mypyc."""
    check_compiler()
    try:
        from mypyc.build import mypycify
    except ImportError as error:
        raise CannotCompileError(f"mypyc is missing ({error})") from None
    package = Path("src/mavherd")
    paths = [str(path) for path in runpy.run_path("gcs/compiled.py")["sources"](package)]
    options = ["--config-file=", "--ignore-missing-imports", "--no-warn-unused-ignores"]
    try:
        extensions: list[Any] = mypycify(
            [*options, *paths], opt_level="2", debug_level="0", group_name="mavherd"
        )
    except SystemExit as error:  # so mypyc ends where it finds a type wrong
        raise CannotCompileError(f"mypyc does not take it: {error}") from None
    for extension in extensions:
        extension.extra_compile_args += FLAGS
    return extensions


def check_compiler() -> None:
    """Raise CannotCompileError unless a C file that includes Python.h compiles."""
    from setuptools._distutils.ccompiler import new_compiler
    from setuptools._distutils.sysconfig import customize_compiler, get_python_inc

    with tempfile.TemporaryDirectory() as folder:
        probe = Path(folder) / "probe.c"
        probe.write_text("#include <Python.h>\n")
        compiler = new_compiler()
        customize_compiler(compiler)
        try:
            compiler.compile([str(probe)], output_dir=folder, include_dirs=[get_python_inc()])
        except Exception as error:
            raise CannotCompileError(f"no working C compiler: {error}") from None


def note(error: Exception) -> None:
    """Say that everything works, only more slowly."""
    print(f"mavherd: stays pure Python, which is slower: {error}", file=sys.stderr)


def extensions() -> list[Any]:
    """Return what to compile now."""
    if not WANTED:
        return []
    try:
        return hot_extensions()
    except CannotCompileError as error:
        if CHOICE == "1" or "build_ext" in sys.argv:
            sys.exit(f"mavherd: cannot compile: {error}")
        note(error)
        return []


setup(ext_modules=extensions(), cmdclass={"build_ext": BuildHot})
