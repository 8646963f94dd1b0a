"""Makes a release's data, part by part, with the present engine: `python -m paper.release`."""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calibration.errors import CalibrationError
from calibration.runs.progress import duration
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_json
from paper.reference import keep_study
from paper.release.pages import KEPT, RECORD, read_record, write_pages
from paper.release.parts import PARTS

if TYPE_CHECKING:
    from paper.release.parts import Part


def due(names: Iterable[str], record: Mapping[str, Any], engine: str) -> list[str]:
    """Of these parts, those that another engine than this one made, or that nobody recorded."""
    return [name for name in names if name not in record or record[name]["engine"] != engine]


PLANNED = ("design.csv", "plan.json")  # which runs there were is told by what they gave


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit status: 0, 1 where a command failed, 2 for wrong input."""
    parser = argparse.ArgumentParser(
        prog="python -m paper.release",
        description="Make the data of a release with the present engine: all of it, or the parts "
        "named. Parts that this engine has made are left as they are; a part that was cut off goes "
        "on from its runs. The pages are written after each part.",
    )
    parser.add_argument("parts", nargs="*", metavar="PART", help="; ".join(p.name for p in PARTS))
    parser.add_argument("-j", "--cores", type=int, default=2, help="2 by default")
    parser.add_argument("-n", "--dry-run", action="store_true", help="say what would be made")
    parser.add_argument("--again", action="store_true", help="make parts again that are made")
    parser.add_argument("--pages", action="store_true", help="write the pages, run nothing")
    args = parser.parse_args(argv)
    try:
        return _release(args)
    except CalibrationError as error:
        print(f"release: {error}", file=sys.stderr)
        return 2


def _release(args):
    chosen, engine = _chosen(args.parts), engine_fingerprint()
    if args.pages:
        write_pages()
        return 0
    record = read_record()
    old = due([p.name for p in chosen], record, engine)
    for part in chosen:
        made = record.get(part.name)
        took = f"; took {duration(made['wall_time_s'])}" if made and made["wall_time_s"] else ""
        print(f"{part.name}: {part.about if part.name in old else 'made'}{took}")
    print(f"{len(old)} of {len(chosen)} parts are not of the present engine, {engine}")
    left = [p for p in chosen if args.again or p.name in old]
    return 0 if args.dry_run or all(_make(part, engine, args.cores) for part in left) else 1


def _chosen(names):
    known = {p.name: p for p in PARTS}
    for name in names:
        if name not in known:
            allowed = ", ".join(known)
            raise CalibrationError(f"{name}: is no part of a release; allowed: {allowed}")
    return [part for name, part in known.items() if not names or name in names]


def _make(part, engine, cores):
    """Make a part, keep it and write the pages; whether its commands ended well."""
    begin = time.monotonic()
    for command in part.commands:
        words = [word.format(cores=cores) for word in command]
        if subprocess.run(words, check=False).returncode:
            print(f"release: {part.name}: {' '.join(words)} failed", file=sys.stderr)
            return False
    collect(part)
    took = round(time.monotonic() - begin, 1)
    known = {p.name for p in PARTS}
    record = {name: made for name, made in read_record().items() if name in known}
    own = {"engine": engine, "date": date.today().isoformat(), "wall_time_s": took, "cores": cores}
    write_json(RECORD, record | {part.name: own})
    write_pages()
    return True


def collect(part: Part) -> None:
    """Copy what is kept of a part's results to results/reference."""
    for name in part.keep:
        keep_study(Path("results") / name, KEPT / name)
    for source, target in part.copies:
        (KEPT / target).mkdir(parents=True, exist_ok=True)
        wanted = {p.name for p in (KEPT / target).iterdir()}
        for path in sorted(p for p in Path(source).iterdir() if p.is_file()):
            if path.name not in PLANNED and (not wanted or path.name in wanted):
                shutil.copy(path, KEPT / target / path.name)
