"""Where numba keeps the engine's compiled code: a folder of this engine, compiled by this software.

numba decides by a kernel's own file alone whether its compiled code is current. It looks neither at
the files of the functions that the kernel calls nor at the versions of LLVM and numpy. The folder
is therefore named after a hash of all the engine's code and of that software, and lies below
whatever folder the user has chosen.

numba writes these files without waiting for the disk and reads them without a check: one that a
power cut has left half would end every later start in a traceback. Such files are deleted here, and
numba makes them again.
"""

import io
import os
import pickletools
import re
import stat
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from dem.fingerprint import kernel_fingerprint, stack_digest

NAME = re.compile(r"engine-[0-9a-f]{16}-[0-9a-f]{12}")
PARTS = {".nbi": 2, ".nbc": 1}
"""Suffix of numba's files -> pickles in one: an index has a version before it."""
LOOKED = ".looked"  # its time is that of the last look for files that are cut off
SLACK_S = 60.0
"""Files so much older than the last look are looked at again: its process may have begun earlier
[s]."""


def use_kernel_cache() -> None:
    """Let numba keep compiled code in `kernel_cache`, without files that are cut off; to be called
    before the first kernel is defined."""
    folder = kernel_cache()
    with suppress(OSError):  # it can only be read, or another process deletes the same file
        forget_cut_off(folder)
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
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
        bases = [Path(os.environ["XDG_CACHE_HOME"])] if os.environ.get("XDG_CACHE_HOME") else []
        with suppress(RuntimeError):  # no HOME, and nobody knows this user
            bases.append(Path.home() / ".cache")
        bases = [base / "granular-calibration" for base in bases]
    for base in bases:
        if _writable(base / name):
            return base / name
    return _private_folder() / name


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
    with suppress(OSError):
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
        own = stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid()
        if own and not status.st_mode & 0o022 and os.access(folder, os.W_OK):
            return folder
    return Path(tempfile.mkdtemp(prefix="granular-calibration-"))


def forget_cut_off(folder: Path) -> None:
    """Delete numba's files below a folder that are not whole, of those that have changed since the
    last look. Raises OSError."""
    mark = folder / LOOKED
    since = mark.stat().st_mtime - SLACK_S if mark.exists() else 0.0
    for file in folder.rglob("*.nb[ic]"):
        if file.stat().st_mtime >= since and not whole(file):
            file.unlink()
    mark.touch()


def whole(file: Path) -> bool:
    """Return whether one of numba's files (.nbi, .nbc) holds its pickles to their ends, and nothing
    more. Nothing in it is run. Raises OSError."""
    stream = io.BytesIO(file.read_bytes())
    try:
        for _ in range(PARTS[file.suffix]):
            for _ in pickletools.genops(stream):
                pass
    except ValueError:  # an opcode that is none, or an argument that ends early
        return False
    return not stream.read(1)
