"""The `dem` command with what stands above the engine: `dem new` begins a study, `dem estimate`
tells its parameters before a run is made, `dem angle` measures photographs, `dem bounce` sounds,
`dem shear` reads shear testers' tables, `dem clump` fills a grain's mesh with spheres."""

import sys
from collections.abc import Sequence
from dataclasses import replace

import yaml

from calibration.errors import CalibrationError
from calibration.interface.declared import add_commands
from calibration.study.new.answers import read_entries
from calibration.study.new.methods.declare import refusal
from calibration.study.new.options import add_options, raws_of
from calibration.study.new.reading_tables import read_filled, write_empty
from dem.cli import main as engine_main

JOBS = 2
"""Runs at once, as the default profile has them."""


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit status: 0, or 2 with one line on stderr for bad input."""
    try:
        return engine_main(argv, (_add,))
    except CalibrationError as error:
        print(f"dem: {error}", file=sys.stderr)
        return 2


def _add(commands):
    add_commands(commands, "dem", {"new": _new, "estimate": _estimate})
    for name in ("new", "estimate"):  # they take what a laboratory measured
        add_options(commands.choices[name])


def _new(args):
    from calibration.runs.feasibility import check_ahead  # loads pandas and the schemas
    from calibration.study.new import study
    from calibration.study.new.laboratory import laboratory_of

    if args.table:
        if any(value for name, value in vars(args).items() if name not in ("table", "command")):
            raise refusal("table_and_more", args.table)
        print(write_empty(args.table))
        return
    if args.folder is None:
        raise refusal("no_folder")
    name = study.study_name(args.folder)
    laboratory = laboratory_of(name, args.folder, _entries(args), args.grains)
    for sentence in study.write_study(laboratory, check_ahead):
        print(sentence)
    if not args.no_pilot:
        if without := _tried(laboratory):
            print(
                f"wrote {args.folder}; do not start it as it is: {', '.join(without)} gave no value"
            )
            return
    written = yaml.safe_load((args.folder / "config.yaml").read_text("utf-8"))
    dear = written["screening"]["replicates"] == 1
    first, quick = (", for a first look", " --config resolution=quick") if dear else ("", "")
    print(f"wrote {args.folder}; next{first}: calibration run '{args.folder}'{quick}")


def _tried(laboratory):
    """Narrow the ranges of a study that is written by the atlas, then try its rigs; those that gave
    no value."""
    from calibration.interface.estimate import ranges_by_atlas  # loads the sampler
    from calibration.runs.progress import progress
    from calibration.study.new.study import config_of, try_study, write_settings

    factors, said, told = ranges_by_atlas(config_of(laboratory), laboratory.factors)
    print(*said, sep="\n")
    laboratory = replace(laboratory, factors=factors, said=[*laboratory.said, *said])
    write_settings(laboratory)
    return try_study(laboratory, print, lambda config: progress(config).sentence(JOBS), told)


def _entries(args):
    """Return what options and table tell. Raises CalibrationError for a sheet of no workbook, and
    for what cannot be read."""
    if args.sheet and ".xlsx" not in str(vars(args)).lower():
        raise refusal("sheet_of_nothing", args.sheet)
    raws, faults = read_filled(args.filled, args.sheet) if args.filled else ([], [])
    return read_entries([*raws, *raws_of(args)], faults)


def _estimate(args):
    from calibration.interface.estimate import estimate_of  # loads pandas and the schemas

    if args.out and args.out.exists():
        raise CalibrationError(f"{args.out}: exists already; allowed: another folder (--out)")
    found = estimate_of(_entries(args))
    print(*found.said, sep="\n")
    if args.out:
        found.write(args.out)
        print(f"wrote {args.out}")


if __name__ == "__main__":
    sys.exit(main())
