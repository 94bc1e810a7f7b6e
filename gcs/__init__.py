"""The ground side: stations, coordination, launcher, report, scripts, command line."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .script import Fleet as Fleet

__all__ = ["Fleet"]


def __getattr__(name: str) -> Any:
    """Load the scripting API when it is first asked for: most of what is here does without."""
    if name in __all__:
        from . import script

        return getattr(script, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
