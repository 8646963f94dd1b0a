"""The `dem` command."""

import argparse
import difflib
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import yaml
from tqdm import tqdm

from dem.errors import DemError, StoppedError
from dem.experiments import experiments
from dem.tables.limits import check_file


def main(argv: Sequence[str] | None = None, more: Iterable[Callable[[Any], object]] = ()) -> int:
    """Entry point; returns the exit status: 0, or 2 with one line on stderr for bad input or a
    failed run, or 130 when interrupted, or 143 when ended by SIGTERM. more: functions that add
    commands of packages above the engine to the parser's commands."""
    try:
        args = _parser(more).parse_args(argv)
        args.command(args)
        sys.stdout.flush()
    except BrokenPipeError:
        # nobody reads on, as behind `| head`, nor what Python flushes at its end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (DemError, OSError) as error:
        print(f"dem: {error}", file=sys.stderr)
        return 143 if isinstance(error, StoppedError) else 2
    except KeyboardInterrupt:
        print("dem: interrupted", file=sys.stderr)
        return 130
    return 0


class _Parser(argparse.ArgumentParser):
    """Tells a fault in one line and where all options stand, not in the whole usage."""

    def error(self, message: str) -> NoReturn:
        """Exit with status 2 and one line on stderr."""
        hint = ""
        if "unrecognized" in message:
            # of this parser and of those of its commands
            own = [a for a in self._actions if isinstance(a, argparse._SubParsersAction)]
            all_of = [self, *(parser for action in own for parser in action.choices.values())]
            known = [option for parser in all_of for option in parser._option_string_actions]
            given = [w for w in message.split() if w[:2] == "--"]
            found = [one for w in given for one in difflib.get_close_matches(w, known, 1)]
            hint = f"; did you mean {' and '.join(found)}?" if found else (
                ". A value and its unit are one word (4mm); a name with spaces stands in quotation "
                "marks"
            )  # fmt: skip
        self.exit(2, f"{self.prog}: {message}{hint}. {self.prog} --help says what is allowed\n")


def _pixels(text):
    if not text.isdigit() or not 100 <= int(text) <= 4000:
        raise argparse.ArgumentTypeError(f"{text} is no width; allowed: 100 to 4000 pixels")
    return int(text)


def _whole(text):
    if not text.removeprefix("-").isdigit():
        raise argparse.ArgumentTypeError(f"{text} is no whole number, such as 10000")
    return int(text)


TYPES: dict[str, Any] = {
    "path": Path, "int": int, "float": float, "whole": _whole, "pixels": _pixels,
}  # fmt: skip


def add_commands(
    commands: Any,
    told: Mapping[str, Any],
    command_of: Callable[[str, list[str]], Callable[[argparse.Namespace], object]],
) -> None:
    """Add commands to `commands`, what `add_subparsers` gives.

    told: {name: {help, description, options: {option: what argparse takes}}}, with a key of TYPES
    for a type; command_of: (name, names of the options) -> function of the parsed arguments.
    """
    for name, own in told.items():
        parser = commands.add_parser(name, help=own["help"], description=own.get("description"))
        given = []
        for option, how in own["options"].items():
            kind = {"type": TYPES[how["type"]]} if "type" in how else {}
            given.append(parser.add_argument(option, **how | kind).dest)
        parser.set_defaults(command=command_of(name, given))


def _parser(more):
    parser = _Parser(
        prog="dem",
        description="Discrete element engine: virtual experiments with spheres. "
        "calibration --help lists the stages of a study.",
    )
    commands = parser.add_subparsers(required=True, metavar="command")
    told = yaml.safe_load(Path(__file__).with_name("commands.yaml").read_text("utf-8"))
    resumed = ", ".join(name for name, e in experiments().items() if e.resumes)
    told["run"]["description"] = told["run"]["description"].format(resumed=resumed)
    told["init"]["options"]["--experiment"]["choices"] = list(experiments())
    own = {"run": _run, "render": _render, "check": _check, "init": _init}
    add_commands(commands, told, lambda name, given: own[name])
    for add in more:
        add(commands)
    return parser


def _run(args):
    from dem.spec import parse_spec  # reads the experiments, of which a user's may be faulty

    spec = _users_spec(args.spec)
    data = spec.model_dump(mode="json")
    if args.seed is not None:
        data["seed"] = args.seed
    if args.frames is not None:
        data["output"]["frame_interval_s"] = args.frames
    spec = parse_spec(data, file=str(args.spec))
    _warn(spec)
    from dem.kernel.threads import use_threads
    from dem.run import run  # the engine takes a second to import; bad input is told at once

    if args.threads is not None:
        use_threads(args.threads)
    with tqdm(total=100, unit="%", bar_format="{l_bar}{bar}| {elapsed}<{remaining} {desc}") as bar:

        def show(fraction, text):
            bar.set_description_str(text, refresh=False)
            bar.update(100 * fraction - bar.n)

        result = run(spec, args.out, show, wait=False)
        bar.update(100 - bar.n)
    for sentence in result["numerics"].get("notes", ()):
        print(f"dem: warning: {sentence}", file=sys.stderr)
    for name, value in result["metrics"].items():
        print(f"{name:32s} {value:.6g}" if isinstance(value, float) else f"{name:32s} {value}")


def _render(args):
    from dem import render  # brings image and VTK libraries along

    run = render.read_run(args.run)
    if args.vtk:
        out, *_ = render.export_vtk(run, args.out)
    else:
        out = args.out or args.run / "heap.webp"
        image = render.draw_run(run, args.width, args.colour, args.azimuth, args.elevation)
        render.save_image(image, out)
    print(out)


def _check(args):
    from dem.spec import content_hash

    spec = _users_spec(args.spec)
    experiments()[spec.experiment].prepare(spec)
    print(f"{args.spec}: a valid {spec.experiment}, seed {spec.seed}, run {content_hash(spec)}")
    _warn(spec)


def _users_spec(path):
    """The `RunSpec` of a file that gives the whole material."""
    from dem.experiments.mesh import check_meshes_of
    from dem.spec import load_spec, require_material

    check_file(path, "configuration")
    spec = load_spec(path)
    require_material(spec, file=str(path))
    check_meshes_of(spec)
    return spec


def _warn(spec):
    from dem.advice import warnings_of  # imports the engine

    for sentence in warnings_of(spec):
        print(f"dem: warning: {sentence}", file=sys.stderr)


def _init(args):
    from dem.template import template

    text = template(args.experiment)
    if args.out is None:
        print(text, end="")
    elif args.out.exists():
        raise DemError(f"{args.out}: exists already")
    else:
        args.out.write_text(text)


if __name__ == "__main__":
    sys.exit(main())
