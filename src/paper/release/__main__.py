"""`python -m paper.release`."""

import sys

from paper.release.command import main

if __name__ == "__main__":
    sys.exit(main())
