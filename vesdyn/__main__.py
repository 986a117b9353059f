"""``python -m vesdyn``: the command line."""

import sys

if __name__ == "__main__":
    try:
        from vesdyn.cli import main

        sys.exit(main())
    except KeyboardInterrupt:  # while the command line itself was read
        sys.exit(130)
