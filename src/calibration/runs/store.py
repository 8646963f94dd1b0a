"""The store of runs: each in a folder named after its content, with an index of what has been
checked.

A result is checked in full once; after that it counts as unchanged while the file system tells the
same size, inode and times of its files. The index is only added to, a line a run, so that the state
of a campaign is known without reading any result.
"""

import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

from calibration.files import set_aside
from dem.errors import ResultError
from dem.results import FAILED, RESULT, RUN_NAME, is_current, read_result

REFUSED = "refused"
"""Where a result without metrics says why it has none: {kind, reason}."""

_place = {"root": Path("results/runs")}


def keep_runs_in(root: str | Path) -> None:
    """Let folder `root` be the one of every `RunStore` that is told no other. A process of the
    workflow works for one study and says so at its start."""
    _place["root"] = Path(root)


class RunStore:
    """Runs below a folder, that of `keep_runs_in` unless given. One that is missing, damaged or of
    another run raises ResultError wherever it is read. looks_only: what is found is not added to
    the index."""

    def __init__(self, root: str | Path | None = None, looks_only: bool = False) -> None:
        self.root, self.looks_only = Path(root or _place["root"]), looks_only
        self._index = self.root / "index.jsonl"
        self._known, self._read_to = {}, 0  # type: ignore[var-annotated]

    def folder(self, name: str) -> Path:
        """Where a run is kept."""
        return self.root / name

    def names(self) -> list[str]:
        """Names of the folders of runs, in order, finished or not."""
        if not self.root.is_dir():
            return []
        return sorted(p.name for p in self.root.iterdir() if RUN_NAME.fullmatch(p.name))

    def result(self, name: str) -> dict[str, Any]:
        """Content of a run's result.json, checked, of whatever engine."""
        known = self._unchanged(name)
        result = read_result(self.folder(name), files=known is None)
        if known is None:
            self._add(name, result)
        return result

    def entry(self, name: str, full: bool = False) -> dict[str, Any]:
        """Return what the index holds of a finished run: `engine`, `wall_time_s`, `refused` of one
        without a value. `full` checks all of it again."""
        known = None if full else self._unchanged(name)
        return known or self._add(name, read_result(self.folder(name)))

    def current(self, name: str) -> dict[str, Any] | None:
        """Content of a run's result where it can be trusted and is of this engine, else None."""
        return _of_this_engine(self.result, name)

    def failure(self, name: str) -> dict[str, Any] | None:
        """Content of a run's failed.json where it can be trusted and is of this engine, else
        None."""
        return _of_this_engine(self.kept_failure, name)

    def kept_failure(self, name: str) -> dict[str, Any]:
        """Content of a run's failed.json, of whatever engine. Raises ResultError."""
        return read_result(self.folder(name), name=FAILED)

    def known(self, name: str) -> dict[str, Any] | None:
        """The entry of a finished run as the index has it, without a look at the run itself unless
        it is new there; None for one that is not finished or cannot be trusted."""
        self._load()
        if name in self._known or not (self.folder(name) / RESULT).exists():
            return self._known.get(name)
        try:
            return self.entry(name)
        except ResultError:
            return None

    def set_aside(self, name: str) -> None:
        """Rename a result that cannot be trusted, so that the run counts as missing. Raises
        OSError."""
        for file in (RESULT, FAILED):
            path = self.folder(name) / file
            if path.exists():
                set_aside(path)

    def _unchanged(self, name):
        """The index's entry of a run whose files are as they were when it was made, else None."""
        self._load()
        entry = self._known.get(name)
        if entry is None:
            return None
        return entry if entry["files"] == self._states(name, entry["files"]) else None

    def _states(self, name, files):
        return {file: _state(self.folder(name) / file) for file in files}

    def _add(self, name, result):
        files = [RESULT, *result["manifest"]["files"]]
        entry = {
            "run": name,
            "engine": result["engine"],
            "wall_time_s": result["numerics"].get("wall_time_s"),
            "files": self._states(name, files),
        }
        if REFUSED in result["numerics"]:
            entry[REFUSED] = True
        self._known[name] = entry
        if self.looks_only:
            return entry
        line = json.dumps(entry, separators=(",", ":")) + "\n"
        try:
            # one short write to the end: lines of several processes do not mix
            number = os.open(self._index, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
        except OSError:  # a store that can only be read is checked each time
            return entry
        try:
            os.write(number, line.encode())
        finally:
            os.close(number)
        return entry

    def _load(self):
        """Read what has been added to the index since the last time; a line that is not whole is
        left out."""
        try:
            if self._index.stat().st_size < self._read_to:
                self._known, self._read_to = {}, 0
            with open(self._index, "rb") as stream:
                stream.seek(self._read_to)
                added = stream.read()
        except OSError:
            return
        whole = added[: added.rfind(b"\n") + 1]
        self._read_to += len(whole)
        for line in whole.splitlines():
            with suppress(ValueError, TypeError, KeyError):  # cut off
                entry = json.loads(line)
                self._known[entry["run"]] = entry


def _of_this_engine(read, name):
    try:
        found = read(name)
    except ResultError:
        return None
    return found if is_current(found["engine"]) else None


def _state(path):
    """[size, inode, times] of a file; None where there is none."""
    try:
        s = os.stat(path)
    except OSError:
        return None
    return [s.st_size, s.st_ino, s.st_mtime_ns, s.st_ctime_ns]
