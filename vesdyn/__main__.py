"""``python -m vesdyn``: the command line."""

import sys

from vesdyn.cli import main

if __name__ == "__main__":
    sys.exit(main())
