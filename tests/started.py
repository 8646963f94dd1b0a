"""Processes that tests start."""

import subprocess
import sys


def python(folder, *words, status=0, **more):
    """Python in a folder, finished, with what it said; it must end with the status, None: with any.

    more: as `subprocess.run` takes it."""
    done = subprocess.run(
        [sys.executable, *map(str, words)], cwd=folder, capture_output=True, text=True, **more
    )
    assert status in (None, done.returncode), done.stdout + done.stderr
    return done
