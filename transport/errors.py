"""The errors a caller of mavherd may want to catch."""

import errno


class MavherdError(Exception):
    """Something a user can mend: the text says where, what and the cure."""

    exit_code = 2  # of the command line


def os_reason(error: OSError) -> str:
    """Return what the operating system complains of, with the cure where there is one."""
    if error.errno in (errno.EMFILE, errno.ENFILE):
        return "too many open files (raise the limit, as with `ulimit -n 4096`)"
    where = f"{error.filename}: " if error.filename else ""
    return where + (error.strerror or str(error))


class LinkError(MavherdError):
    """An address that cannot be parsed, a port that is taken, a link that cannot be opened."""


class VehicleError(MavherdError):
    """A vehicle or coordinator that could not start, died or froze."""

    exit_code = 3
