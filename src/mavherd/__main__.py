"""`mavherd` and `python -m mavherd`."""

import sys

from .gcs.cli import main

if __name__ == "__main__":
    sys.exit(main())
