"""The `dem` command with what stands above the engine: `dem new` begins a study, `dem estimate`
tells its parameters before a run is made, `dem angle` measures photographs, `dem bounce` sounds,
`dem shear` reads shear testers' tables, `dem clump` fills a grain's mesh with spheres."""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import yaml

from calibration.errors import CalibrationError
from dem.cli import main as engine_main

JOBS = 2
"""Runs at once, as the default profile has them."""


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit status: 0, or 2 with one line on stderr for bad input."""
    try:
        return engine_main(
            argv, (_add_new, _add_estimate, _add_angle, _add_bounce, _add_shear, _add_clump)
        )
    except CalibrationError as error:
        print(f"dem: {error}", file=sys.stderr)
        return 2


def _add_new(commands):
    new = commands.add_parser(
        "new",
        help="begin a study from what a laboratory measured",
        description="Write a study of your material and rig into a new folder. Values carry their "
        "unit. An option of a test takes its readings, then key=value for the rest: --drop 78mm "
        "81mm height=300mm.",
    )
    new.add_argument(
        "folder", type=Path, nargs="?", help="folder to write; its name becomes the study's"
    )
    new.add_argument(
        "--table",
        type=Path,
        metavar="FILE",
        help="write an empty table (.csv or .xlsx) with a row a question, and nothing else",
    )
    new.add_argument(
        "--grains",
        type=_whole,
        help="to simulate at most; larger ones of the same volume are poured where your rig takes "
        "more. 4,000 unless given, 10,000 where a funnel's heap is all that was measured",
    )
    new.add_argument(
        "--no-pilot", action="store_true", help="leave the ranges as they are, make no run"
    )
    _add_told(new)
    new.set_defaults(command=_new)


def _whole(text):
    if not text.removeprefix("-").isdigit():
        raise argparse.ArgumentTypeError(f"{text} is no whole number, such as 10000")
    return int(text)


def _new(args):
    from calibration.runs.feasibility import check_ahead  # loads pandas and the schemas
    from calibration.study.new import reading_tables, study
    from calibration.study.new.laboratory import laboratory_of

    words = _words(args)
    if args.table:
        if args.folder or words:
            raise CalibrationError(
                f"--table {args.table}: writes an empty table, and what stands beside it would be "
                f"lost; allowed: by itself, or --from {args.table} where it is filled in"
            )
        print(reading_tables.write_empty(args.table))
        return
    if args.folder is None:
        raise CalibrationError("the folder is missing; allowed: dem new FOLDER, or --table FILE")
    name = study.check_folder(args.folder)
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
    from calibration.interface.ranges import ranges_by_atlas  # loads the sampler
    from calibration.runs.progress import progress
    from calibration.study.new.pilot import config_of, heard, try_study
    from calibration.study.new.study import write_settings

    with heard("asking the atlas", print):
        factors, said, told = ranges_by_atlas(config_of(laboratory), laboratory.factors)
    print(*said, sep="\n")
    laboratory = replace(laboratory, factors=factors, said=[*laboratory.said, *said])
    write_settings(laboratory)
    return try_study(laboratory, print, lambda config: progress(config).sentence(JOBS), told)


def _add_told(parser):
    """The options by which a laboratory tells what it measured."""
    from calibration.study.new.options import add_options

    parser.add_argument(
        "--from",
        type=Path,
        metavar="FILE",
        dest="filled",
        help="take what such a table tells, filled in (dem new --table)",
    )
    parser.add_argument("--sheet", help="of a workbook with several: the one that is meant")
    add_options(parser)


def _entries(args):
    """What `_add_told`'s options and table tell."""
    from calibration.study.new import options, reading_tables
    from calibration.study.new.answers import read_entries

    raws = reading_tables.read_filled(args.filled, args.sheet) if args.filled else []
    return read_entries([*raws, *options.raws_of(args)])


def _words(args):
    """All words that tell something. Raises CalibrationError for a sheet of no workbook."""
    from calibration.study.new.options import words_given

    words = words_given(args)
    files = [*words, str(args.filled)]
    if args.sheet and not any(word.lower().endswith(".xlsx") for word in files):
        raise CalibrationError(
            f"--sheet {args.sheet}: no option names a workbook; allowed: beside one, such as "
            "--measured tests.xlsx"
        )
    return words


def _add_estimate(commands):
    estimate = commands.add_parser(
        "estimate",
        help="parameters in a minute, from runs that are kept",
        description="Tell the parameters that your readings ask for, what they leave open, what is "
        "expected of other tests and which to make next. Options are those of dem new; no run is "
        "made.",
    )
    estimate.add_argument("--out", type=Path, help="new folder for tables and figure")
    _add_told(estimate)
    estimate.set_defaults(command=_estimate)


def _estimate(args):
    from calibration.interface.estimate import estimate_of  # loads pandas and the schemas

    _words(args)
    if args.out and args.out.exists():
        raise CalibrationError(f"{args.out}: exists already; allowed: another folder (--out)")
    found = estimate_of(_entries(args))
    print(*found.said, sep="\n")
    if args.out:
        found.write(args.out)
        print(f"wrote {args.out}")


def _add_angle(commands):
    angle = commands.add_parser(
        "angle",
        help="angle of repose of heaps on photographs",
        description="Measure photographs of a heap, seen from the side before a plain backdrop, by "
        "the flank fit that the simulation's heaps are measured by.",
    )
    angle.add_argument("photos", type=Path, nargs="+", metavar="PHOTO")
    angle.add_argument("--out", type=Path, help="table to write, for the configuration's target")
    angle.add_argument(
        "--scale",
        metavar="LENGTH/PIXELS",
        help="a length and its pixels in the photograph (100mm/830): the height is then told too",
    )
    angle.add_argument(
        "--shown",
        type=Path,
        help="folder for the pictures with the fit; beside each photo unless given",
    )
    angle.add_argument(
        "--camera",
        metavar="DISTANCE/HEIGHT",
        help="where the lens stood, from the heap's middle and above its base (600mm/150mm): what "
        "a camera that looks down reads too flat is corrected",
    )
    angle.add_argument(
        "--plumb",
        metavar="X,Y/X,Y",
        help="instead: two points of a plumb line beside the heap, in pixels of the photograph "
        "from its upper left corner",
    )
    angle.add_argument(
        "--focal",
        metavar="LENGTH",
        help="of the lens, as of 35 mm film (26mm for most phones), where the photograph does not "
        "say it",
    )
    angle.set_defaults(command=_angle)


def _angle(args):
    from calibration.intake.photo.camera import view_of  # brings image libraries along
    from calibration.intake.photo.table import measure_photos

    view = view_of(args.camera, args.plumb, args.focal)
    print(*measure_photos(args.photos, args.out, args.scale, args.shown, view), sep="\n")


def _add_bounce(commands):
    bounce = commands.add_parser(
        "bounce",
        help="restitution of a grain from the sound of its bounces",
        description="Read WAV recordings of one grain that bounces on a plate, and tell its "
        "restitution by the times between the impacts.",
    )
    bounce.add_argument("sounds", type=Path, nargs="+", metavar="WAV")
    bounce.add_argument("--out", type=Path, help="table of drops and rebounds to write")
    bounce.set_defaults(command=_bounce)


def _bounce(args):
    from calibration.intake.sound import measure_sounds  # loads scipy

    print(*measure_sounds(args.sounds, args.out), sep="\n")


def _add_shear(commands):
    shear = commands.add_parser(
        "shear",
        help="yield locus out of a shear tester's table",
        description="Read normal and shear stresses out of tables, and tell the yield locus.",
    )
    shear.add_argument("tables", type=Path, nargs="+", metavar="TABLE")
    shear.add_argument("--out", type=Path, help="table of shear stresses to write")
    shear.add_argument("--sheet", help="of a workbook with several: the one with the stresses")
    shear.set_defaults(command=_shear)


def _shear(args):
    from calibration.intake.shear_tester import measure_shear  # loads scipy

    print(*measure_shear(args.tables, args.out, args.sheet), sep="\n")


def _add_clump(commands):
    clump = commands.add_parser(
        "clump",
        help="a grain's mesh filled with spheres",
        description="Fill a closed mesh of a grain (STL, in millimetres) with spheres and write "
        "the table that particles.clump reads.",
    )
    clump.add_argument("mesh", type=Path, metavar="STL")
    clump.add_argument("--spheres", type=int, default=8, help="at most, up to ten; 8 unless given")
    clump.add_argument("--out", type=Path, help="table to write; beside the mesh unless given")
    clump.set_defaults(command=_clump)


def _clump(args):
    from calibration.intake.clump_from_mesh import fill_mesh  # loads scipy

    print(*fill_mesh(args.mesh, args.spheres, args.out), sep="\n")


if __name__ == "__main__":
    sys.exit(main())
