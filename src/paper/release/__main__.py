"""Makes a release's data, part by part, with the present engine: `python -m paper.release`. The
parts stand in parts.yaml, in the order in which they are made."""

from __future__ import annotations

import argparse
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path

import pandas as pd
import yaml

from calibration.errors import CalibrationError, ConfigError
from calibration.files import write_table
from calibration.intake.tables import read_written
from calibration.runs.plans import read_values
from calibration.runs.progress import duration
from calibration.runs.verify import FOLDER
from dem.fingerprint import engine_fingerprint
from dem.io.files import write_json
from paper.release.pages import FUNNELS, KEPT, RECORD, read_record, write_pages

PARTS = yaml.safe_load(Path(__file__).with_name("parts.yaml").read_text("utf-8"))
NOT_KEPT = ("logs", FOLDER)
PLANNED = ("design.csv", "plan.json")  # which runs there were is told by what they gave
TABLES = "effects anova runs coefficients numerics scaling parameters next reproduction"
"""What is kept of a stage beside its summaries."""
POURED = ("screening", "candidate_first", "candidate", "validation")
METRIC = "angle_of_repose_deg"


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit status: 0, 1 where a command failed, 2 for wrong input."""
    parser = argparse.ArgumentParser(
        prog="python -m paper.release",
        description="Make the data of a release with the present engine: all of it, or the parts "
        "named. Parts that this engine has made are left as they are; a part that was cut off goes "
        "on from its runs. The pages are written after each part.",
    )
    parser.add_argument("parts", nargs="*", metavar="PART", help="; ".join(PARTS))
    parser.add_argument("-j", "--cores", type=int, default=2, help="2 by default")
    parser.add_argument("-n", "--dry-run", action="store_true", help="say what would be made")
    parser.add_argument("--again", action="store_true", help="make parts again that are made")
    parser.add_argument("--pages", action="store_true", help="write the pages, run nothing")
    args = parser.parse_args(argv)
    try:
        return _release(args)
    except (CalibrationError, ConfigError) as error:
        print(f"release: {error}", file=sys.stderr)
        return 2


def _release(args):
    for name in set(args.parts) - set(PARTS):
        raise CalibrationError(f"{name}: is no part of a release; allowed: {', '.join(PARTS)}")
    if args.pages:
        write_pages()
        return 0
    chosen, engine, record = args.parts or list(PARTS), engine_fingerprint(), read_record()
    # what another engine than this one made, or nobody recorded
    old = [name for name in chosen if record.get(name, {}).get("engine") != engine]
    for name in chosen:
        made = record.get(name)
        took = f"; took {duration(made['wall_time_s'])}" if made and made["wall_time_s"] else ""
        print(f"{name}: {PARTS[name]['about'] if name in old else 'made'}{took}")
    print(f"{len(old)} of {len(chosen)} parts are not of the present engine, {engine}")
    left = [name for name in chosen if args.again or name in old]
    return 0 if args.dry_run or all(_make(name, engine, args.cores) for name in left) else 1


def _make(name, engine, cores):
    """Make a part, keep it and write the pages; whether its commands ended well."""
    begin, part = time.monotonic(), PARTS[name]
    for command in part["commands"]:
        program, *words = shlex.split(command.replace("{cores}", str(cores)))
        python = sys.executable if program == "python" else program
        if subprocess.run([python, *words], check=False).returncode:
            print(f"release: {name}: {command} failed", file=sys.stderr)
            return False
    for study in part.get("keep", ()):
        _keep(Path("results") / study, KEPT / study)
        if designs := poured(Path("results") / study):
            write_table(funnels(designs), KEPT / study / FUNNELS)
    for source, target in part.get("copies", {}).items():
        _copy(Path(source), KEPT / target)
    took = round(time.monotonic() - begin, 1)
    record = {known: made for known, made in read_record().items() if known in PARTS}
    own = {"engine": engine, "date": date.today().isoformat(), "wall_time_s": took, "cores": cores}
    write_json(RECORD, record | {name: own})
    write_pages()
    return True


def poured(study: Path) -> dict[str, Path]:
    """{stage: its design} of the planned stages of a study that pour heaps."""
    designs = {stage: study / stage / "design.csv" for stage in POURED}
    return {stage: path for stage, path in designs.items() if path.is_file()}


def funnels(designs: Mapping[str, Path]) -> pd.DataFrame:
    """Table of heaps of stages {stage: design}: stage, run_id, angle of repose [°] and the most
    grains that stood in the funnel at once; empty where a run gave no value. A run of two stages
    counts once."""
    rows = [read_written(path)[["run_id"]].assign(stage=s) for s, path in designs.items()]
    table = pd.concat(rows, ignore_index=True)[["stage", "run_id"]].drop_duplicates("run_id")
    return table.assign(**{m: read_values(table["run_id"], m) for m in (METRIC, "hold_up")})


def _keep(study, target):
    """Copy the summaries and tables of a study's stages; plans and figures stay behind."""
    tables = [f"{name}.csv" for name in TABLES.split()]
    for path in (p for p in study.glob("*/*") if p.parent.name not in NOT_KEPT):
        if path.name in tables or (path.suffix == ".json" and path.name not in PLANNED):
            (target / path.parent.name).mkdir(parents=True, exist_ok=True)
            shutil.copy(path, target / path.parent.name)


def _copy(source, target):
    """Copy a folder's files: those that the target has already and all pictures, or all."""
    target.mkdir(parents=True, exist_ok=True)
    wanted = {p.name for p in target.iterdir()}
    for path in sorted(p for p in source.iterdir() if p.is_file() and p.name not in PLANNED):
        if not wanted or path.name in wanted or path.suffix == ".svg":
            shutil.copy(path, target / path.name)


if __name__ == "__main__":
    sys.exit(main())
