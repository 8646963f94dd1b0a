"""Discrete element engine for spheres: Hertz-Mindlin contacts, numba kernels, SI units.

numba looks only at a kernel's own file to decide whether its compiled code is current, not at the files of what it
calls. Compiled code is therefore kept in a folder named after a hash of all the engine's sources.
"""

import os
from pathlib import Path

from dem.fingerprint import engine_fingerprint

if "NUMBA_CACHE_DIR" not in os.environ:
    _base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    os.environ["NUMBA_CACHE_DIR"] = str(_base / "granular-calibration" / engine_fingerprint())
