"""`mavherd` and `python -m mavherd`."""

import sys


def main() -> int:
    """Run the command line; Ctrl-C while it is being imported is no different from later."""
    try:
        from .gcs.cli import main as command_line

        return command_line()
    except KeyboardInterrupt:
        print("mavherd: interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
