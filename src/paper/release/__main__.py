"""`python -m paper.release`."""

import sys

from paper.release.command import main

sys.exit(main())
