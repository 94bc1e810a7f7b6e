"""`mavherd` and `python -m mavherd`."""

import os
import sys


def main() -> int:
    """Run the command line; Ctrl-C while it is being imported is no different from later."""
    try:
        from .gcs.ctrl_c import remember

        remember()
        _open_standard_streams()
        from .gcs.cli import main as command_line

        return command_line()
    except KeyboardInterrupt:
        from .gcs.complaint import interrupted

        return interrupted()


def _open_standard_streams() -> None:
    """Keep our and our children's sockets off the number of a standard stream that is closed."""
    while (fd := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(fd, True)
    os.close(fd)


if __name__ == "__main__":
    sys.exit(main())
