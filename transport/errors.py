"""The errors a caller of mavherd may want to catch."""


class MavherdError(Exception):
    """Something a user can mend: the text says where, what and the cure."""

    exit_code = 2  # of the command line


class LinkError(MavherdError):
    """An address that cannot be parsed, a port that is taken, a link that cannot be opened."""


class VehicleError(MavherdError):
    """A vehicle or coordinator that could not start, died or froze."""

    exit_code = 3
