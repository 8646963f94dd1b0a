"""Where numba keeps the engine's compiled code: a folder of this engine, compiled by this software.

numba decides by a kernel's own file alone whether its compiled code is current. It looks neither at
the files of the functions that the kernel calls nor at the versions of LLVM and numpy. The folder
is therefore named after a hash of all the engine's code and of that software, and lies below
whatever folder the user has chosen.
"""

import os
import re
import stat
import sys
import tempfile
from pathlib import Path

from dem.fingerprint import kernel_fingerprint, stack_digest

NAME = re.compile(r"engine-[0-9a-f]{16}-[0-9a-f]{12}")


def use_kernel_cache() -> None:
    """Let numba keep compiled code in `kernel_cache`; to be called before the first kernel is
    defined."""
    os.environ["NUMBA_CACHE_DIR"] = str(kernel_cache())
    if "numba" in sys.modules:
        sys.modules["numba"].config.reload_config()


def kernel_cache() -> Path:
    """Folder of this engine's compiled code, below NUMBA_CACHE_DIR where that is set, else below
    the user's cache or, where that cannot be written, below a private temporary folder."""
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    name = f"engine-{kernel_fingerprint()}-{stack_digest()}"
    if chosen:
        base = Path(chosen)
        # a process that this one has started finds the folder of this one
        bases = [base.parent if NAME.fullmatch(base.name) else base]
    else:
        bases = [b / "granular-calibration" for b in _user_caches()]
    for base in bases:
        if _writable(base / name):
            return base / name
    return _private_folder() / name


def _user_caches():
    if os.environ.get("XDG_CACHE_HOME"):
        yield Path(os.environ["XDG_CACHE_HOME"])
    try:
        yield Path.home() / ".cache"
    except RuntimeError:  # no HOME, and nobody knows this user
        return


def _writable(folder):
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _private_folder():
    """A folder of this user's own: compiled code of a stranger must never be loaded."""
    folder = Path(tempfile.gettempdir()) / f"granular-calibration-{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
        own = stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid()
        if own and not status.st_mode & 0o022 and os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix="granular-calibration-"))
