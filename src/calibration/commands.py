"""The `dem` command with what stands above the engine: `dem angle` measures photographs."""

import sys
from pathlib import Path

from calibration.errors import CalibrationError
from dem.cli import main as engine_main


def main(argv=None):
    """Entry point; returns the exit status: 0, or 2 with one line on stderr for bad input."""
    try:
        return engine_main(argv, (_add_angle,))
    except CalibrationError as error:
        print(f"dem: {error}", file=sys.stderr)
        return 2


def _add_angle(commands):
    angle = commands.add_parser(
        "angle",
        help="angle of repose of heaps on photographs",
        description="Measure photographs of a heap, seen from the side before a plain backdrop, by the flank fit that "
        "the simulation's heaps are measured by.",
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
    angle.set_defaults(command=_angle)


def _angle(args):
    from calibration.photo.table import measure_photos  # brings image libraries along

    for line in measure_photos(args.photos, args.out, args.scale, args.shown):
        print(line)


if __name__ == "__main__":
    sys.exit(main())
