"""What ends every wait of a run."""


class Interrupted(Exception):  # noqa: N818 - an order, not an error
    """The user wants the run to end now."""
