"""Makes a release's data: says beforehand how long it takes, goes on where it was cut off, and
tells how far it is."""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

from calibration.errors import CalibrationError
from calibration.files import read_json
from calibration.runs.progress import duration
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_json
from paper.reference import keep_study
from paper.release.pages import write_pages
from paper.release.parts import PARTS, estimate, part_of
from paper.release.record import KEPT, Made, due, read_record, write_record

if TYPE_CHECKING:
    from paper.release.parts import Part


WORK = Path("results/release")
HISTORY = Path("benchmarks/history.csv")
PLANNED = ("design.csv", "plan.json")  # which runs there were is told by what they gave
LINE_S = 10.0  # between two progress lines


class Progress:
    """Which parts this engine has made, and what each has taken so far, kept in
    results/release/<engine>.json."""

    def __init__(self, engine: str, work: str | Path = WORK) -> None:
        self.path = Path(work) / f"{engine}.json"
        self.state = read_json(self.path) if self.path.is_file() else {"done": {}, "spent_s": {}}

    def done(self, name: str) -> bool:
        """Whether this engine has made a part."""
        return name in self.state["done"]

    def spend(self, name: str, seconds: float) -> None:
        """Count further seconds of a part."""
        self.state["spent_s"][name] = self.state["spent_s"].get(name, 0.0) + seconds
        self._write()

    def spent(self, name: str) -> float:
        """Seconds that a part has taken so far."""
        return self.state["spent_s"].get(name, 0.0)

    def finish(self, name: str) -> None:
        """Mark a part as made today."""
        self.state["done"][name] = date.today().isoformat()
        self._write()

    def _write(self):
        self.path.parent.mkdir(parents=True, exist_ok=True)
        write_json(self.path, self.state)


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit status: 0, 1 where a command failed, 2 for wrong input."""
    args = _parser().parse_args(argv)
    try:
        chosen = _chosen(args.parts)
        if args.pages:
            write_pages()
            return 0
        engine = engine_fingerprint()
        progress = Progress(engine)
        left = [p for p in chosen if args.again or not progress.done(p.name)]
        record = read_record()
        for line in plan(chosen, left, record, args.cores):
            print(line)
        old = due([p.name for p in chosen], record, engine)
        print(f"a release is due: {len(old)} of {len(chosen)} parts are not of the present engine, "
              f"{engine}" if old else f"all parts are of the present engine, {engine}")  # fmt: skip
        return 0 if args.dry_run else _make(left, progress, engine, args.cores)
    except CalibrationError as error:
        print(f"release: {error}", file=sys.stderr)
        return 2


def _parser():
    parser = argparse.ArgumentParser(
        prog="python -m paper.release",
        description="Make the data of a release with the present engine: all of it, or the parts "
        "named. One that was cut off goes on; parts that this engine has made are left as they "
        "are. The pages are written after each part.",
    )
    parser.add_argument("parts", nargs="*", metavar="PART", help="; ".join(p.name for p in PARTS))
    parser.add_argument("-j", "--cores", type=int, default=2, help="2 by default")
    parser.add_argument("-n", "--dry-run", action="store_true", help="say what would be made")
    parser.add_argument("--again", action="store_true", help="make parts again that are made")
    parser.add_argument("--pages", action="store_true", help="write the pages, run nothing")
    return parser


def _chosen(names):
    for name in names:
        if part_of(name) is None:
            allowed = ", ".join(p.name for p in PARTS)
            raise CalibrationError(f"{name}: is no part of a release; allowed: {allowed}")
    return [p for p in PARTS if not names or p.name in names]


def plan(
    chosen: Sequence[Part], left: Sequence[Part], record: Mapping[str, Made], cores: int
) -> list[str]:
    """Lines: each part with the time it is expected to take, and the sum."""
    lines, total, unknown = [], 0.0, 0
    for part in chosen:
        seconds, whence = estimate(part, record, HISTORY, cores)
        if part not in left:
            lines.append(f"{part.name}: made")
            continue
        known = seconds is not None
        total, unknown = total + (seconds or 0.0), unknown + (not known)
        took = f"about {duration(seconds)} ({whence})" if known else whence  # type: ignore[arg-type]
        lines.append(f"{part.name}: {part.about}; {took}")
    more = f", and {unknown} parts that were never timed" if unknown else ""
    lines.append(f"{len(left)} of {len(chosen)} parts to make: about {duration(total)}{more}")
    return lines


def _make(left, progress, engine, cores):
    for place, part in enumerate(left, 1):
        expected, _ = estimate(part, read_record(), HISTORY, cores)
        log = WORK / f"{part.name.replace(' ', '_')}.log"
        log.parent.mkdir(parents=True, exist_ok=True)
        for command in part.commands:
            words = [word.format(cores=cores) for word in command]
            head = f"part {place} of {len(left)}, {part.name}"
            if not _run(words, log, head, progress, part.name, expected):
                print(f"\nrelease: {part.name}: {' '.join(words)} failed; see {log}. Start it "
                      "again to go on", file=sys.stderr)  # fmt: skip
                return 1
        collect(part)
        made = Made(engine, date.today().isoformat(), round(progress.spent(part.name), 1), cores)
        known = {n: m for n, m in read_record().items() if part_of(n)}
        write_record(known | {part.name: made})
        progress.finish(part.name)
        write_pages()
    print("The release's data are of this engine; docs and results/reference have changed.")
    return 0


def _run(words, log, head, progress, name, expected):
    """Run a command with its output in `log`; whether it ended well. A line tells the part, the
    time and the command's last line."""
    begin = booked = time.monotonic()
    with open(log, "a", encoding="utf-8") as out:
        print(f"$ {' '.join(words)}", file=out, flush=True)
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                   text=True, encoding="utf-8", errors="replace")  # fmt: skip
        last = [""]

        def copy():
            for line in process.stdout:
                out.write(line)
                out.flush()
                last[0] = line.strip() or last[0]

        reader = threading.Thread(target=copy, daemon=True)
        reader.start()
        try:
            while process.poll() is None:
                try:
                    process.wait(LINE_S)
                except subprocess.TimeoutExpired:
                    pass
                now = time.monotonic()
                progress.spend(name, now - booked)
                booked = now
                spent = progress.spent(name)
                of = f" of about {duration(expected)}" if expected else ""
                print(f"\r{head}: {duration(spent)}{of}; {under_way(last[0])[:60]:60}", end="",
                      file=sys.stderr, flush=True)  # fmt: skip
        finally:
            if process.poll() is None:
                process.terminate()
                process.wait()
        reader.join()
        process.stdout.close()
    progress.spend(name, max(time.monotonic() - max(booked, begin), 0.0))
    return process.returncode == 0


def under_way(line: str) -> str:
    """What of a campaign's line is under way, as 60 columns hold no more: a part may want one stage
    of a study whose other runs are counted before it."""
    return line.rpartition("; now ")[2]


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
