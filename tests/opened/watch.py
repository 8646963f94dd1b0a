"""What a process opens, renames and deletes, for tests of what a rule declares."""

import json
import os
import re
import sys
from contextlib import contextmanager

PARTIAL = re.compile(r"\.partial\.|\..*\.partial")
"""What a writer renames when it is done."""
RUN = re.compile(r"[a-z_]+-[0-9a-f]{16}")
_LISTS, _HOOKED = [], []


def _hook(event, arguments):
    if _LISTS and event in ("open", "os.rename", "os.remove"):
        path = arguments[event == "os.rename"]
        if isinstance(path, str | bytes | os.PathLike):
            for seen in _LISTS:
                seen.add(os.fsdecode(path))


@contextmanager
def watching():
    """Give the set of paths that this process opens, renames something to, or deletes from now
    on."""
    if not _HOOKED:  # a hook stays until the process ends
        sys.addaudithook(_hook)
        _HOOKED.append(True)
    seen = set()
    _LISTS.append(seen)
    try:
        yield seen
    finally:
        _LISTS.remove(seen)


def undeclared(seen, declared, results="results"):
    """Paths below a folder of results that were touched and are not among the files, or in the
    folders, that a rule declares. A run is declared by its name in one of them.

    Left out: folders, what writers rename, the store's own index, and what the workflow notes of
    rules and progress in hidden files.
    """
    here, root = {os.path.realpath(path) for path in declared}, os.path.realpath(results)
    runs = {name for path in here for name in _runs_of(path)}
    found = set()
    for path in map(os.path.realpath, seen):
        inside = os.path.relpath(path, root)
        parts = inside.split(os.sep)
        if parts[0] == os.pardir or os.path.isdir(path) or PARTIAL.match(parts[-1]):
            continue
        if parts[0] == "runs" and (len(parts) == 2 or parts[1] in runs):
            continue
        if parts[1:] and parts[1].startswith("."):
            continue
        if not any(path == one or path.startswith(one + os.sep) for one in here):
            found.add(inside)
    return sorted(found)


def _runs_of(path):
    """Names of runs in a declared path and in the table or the plan that it is."""
    found = RUN.findall(path)
    if path.endswith((".json", ".csv")) and os.path.isfile(path):
        with open(path, encoding="utf-8") as stream:
            found += RUN.findall(stream.read())
    return found


def leave(snakemake, seen, folder):
    """Write what a job of snakemake touched beside what its rule declares, as a JSON file."""
    files = [*snakemake.input, *snakemake.output, *snakemake.log]
    files += snakemake.params.get("beside", ())
    found = {"rule": snakemake.rule, "undeclared": undeclared(seen, map(str, files))}
    with open(os.path.join(folder, f"{snakemake.rule}-{os.getpid()}.json"), "w") as stream:
        json.dump(found, stream)
