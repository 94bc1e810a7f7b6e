"""Reach a field of the settings by its path, such as `settings.fence.radius`."""

from ..flight.settings import Settings


def read(settings: Settings, path: str) -> object:
    """Return the value at `path`."""
    holder, key = _holder(settings, path)
    return holder[key] if isinstance(holder, dict) else getattr(holder, key)


def write(settings: Settings, path: str, value: object) -> None:
    """Put `value` at `path`, as the type that is there already."""
    holder, key = _holder(settings, path)
    old = read(settings, path)
    if isinstance(value, int | float) and isinstance(old, bool | int | float):
        value = bool(value) if isinstance(old, bool) else type(old)(value)
    if isinstance(holder, dict):
        holder[key] = value
    else:
        setattr(holder, key, value)


def _holder(settings: Settings, path: str) -> tuple[object, str]:
    """Return the object that has the field, and the field's name."""
    first, *between, key = path.split(".")
    if first != "settings":
        raise ValueError(f"{path} is no path of the settings")
    holder: object = settings
    for name in between:
        holder = holder[int(name)] if isinstance(holder, list) else getattr(holder, name)
    return holder, key
