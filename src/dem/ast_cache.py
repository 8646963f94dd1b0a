"""What was read out of Python sources, kept between starts: parsing all of the project's takes
seconds, and every start asks."""

import atexit
import gzip
import hashlib
import importlib.util
import json
import sys
import zlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Generic, TypeVar

from dem.io.files import replace_file

Reading = TypeVar("Reading")
MOST = 4000
"""Readings that a file keeps; beyond that those which no one asked for go."""


class Readings(Generic[Reading]):
    """A function of a source's text whose answers are kept beside the compiled Python of its
    module, by the text. An edit of the module, another Python or another `given` begins anew.

    read : function of a text, with answers of JSON
    given : what they depend on beside the text and the code of its module
    """

    def __init__(self, read: Callable[[str], Reading], given: object = None) -> None:
        self.read, self.given = read, given
        self.asked: dict[str, Reading] = {}
        self.kept: dict[str, Reading] | None = None
        self.grown = False

    def __call__(self, text: str) -> Reading:
        """The answer for a text."""
        key = hashlib.sha256(text.encode()).hexdigest()
        if self.kept is None:
            self.kept = self._load()
            atexit.register(self.save)
        if key not in self.asked:
            self.grown |= key not in self.kept
            self.asked[key] = self.kept[key] if key in self.kept else self.read(text)
        return self.asked[key]

    @property
    def path(self) -> Path:
        """Where the answers are kept."""
        source = str(sys.modules[self.read.__module__].__file__)
        code = hashlib.sha256(Path(source).read_bytes() + repr(self.given).encode())
        compiled = Path(importlib.util.cache_from_source(source))
        return compiled.with_suffix(f".{self.read.__name__}-{code.hexdigest()[:12]}.json.gz")

    def _load(self):
        try:
            found = json.loads(gzip.decompress(self.path.read_bytes()))
        except (OSError, ValueError, EOFError, zlib.error):  # none yet, or damaged
            return {}
        return found if isinstance(found, dict) else {}

    def save(self) -> None:
        """Write what is new, in place of what an older code of the module left. A folder that
        cannot be written to keeps nothing."""
        if not self.grown or sys.dont_write_bytecode:
            return
        answers = self._load() | self.asked
        kept = json.dumps(answers if len(answers) <= MOST else self.asked)
        path, packed = self.path, gzip.compress(kept.encode(), compresslevel=1)
        with suppress(OSError):
            path.parent.mkdir(exist_ok=True)
            replace_file(path, lambda file: file.write(packed))
            for other in path.parent.glob(f"{path.name.split('-')[0]}-*.json.gz"):
                if other != path:
                    other.unlink(missing_ok=True)
