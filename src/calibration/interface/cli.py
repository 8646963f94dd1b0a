"""The `calibration` command."""

import argparse
import difflib
import sys
from collections.abc import Sequence
from pathlib import Path

from calibration.errors import CalibrationError
from calibration.interface.declared import add_commands
from calibration.runs.snakemake_command import LOGGER, call, rule_names, snakemake_command
from calibration.study.stage import load_stages
from dem.errors import DemError


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit status: 0, or 1 where something is wrong, or 2 for input that
    cannot be used."""
    args = _parser().parse_args(argv)
    try:
        return args.command(args)
    except (CalibrationError, DemError, OSError) as error:
        print(f"calibration: {error}", file=sys.stderr)
        return 2


class _WithStages(argparse.ArgumentParser):
    """Its help lists the stages, with the names that `calibration run STUDY NAME` takes."""

    def format_help(self) -> str:
        """Return the help."""
        stages = load_stages("calibration.stages", "diagnosis.declared").values()
        lines = [f"  {stage.rule:20}{stage.title}" for stage in stages]
        return "\n".join([super().format_help(), "stages of calibration run STUDY:", *lines, ""])


def _parser():
    parser = _WithStages(prog="calibration", description="Studies and their results.")
    commands = parser.add_subparsers(
        required=True, metavar="command", parser_class=argparse.ArgumentParser
    )
    own = {"verify": _verify, "run": _run, "allow": _allow, "deck": _deck}
    add_commands(commands, "calibration", own)
    return parser


def _run(args):
    from calibration.interface.api import config_file  # loads pandas

    _check_words(args.arguments)
    # a folder's own workflow may have no profile that names it; `=` keeps snakemake from taking a
    # stage that follows for a second logger
    told = [] if "--logger" in args.arguments else [f"--logger={LOGGER}"]
    command = snakemake_command([config_file(args.study)], *told, *args.arguments)
    try:
        return call(command).returncode
    except KeyboardInterrupt:
        return 130  # as a shell says it


def _allow(args):
    from calibration.intake.started_code import allow
    from calibration.interface.api import Study  # loads pandas

    study = Study(*args.study, root=".")
    found = allow(study.config, Path.cwd())
    for key, value in found.items():
        print(f"{study.name}: {key} = {value} is allowed in {Path.cwd()}")
    if not found:
        print(f"{study.name}: names nothing that starts code")
    return 0


def _deck(args):
    from calibration.telling.export.decks import check  # loads pandas

    return check(args.folder, args.seeds, args.timeout)


def _check_words(arguments):
    """Raise CalibrationError for a word that is nearly a rule's name, as what is far from all may
    be an option, a file or a rule of the user's own; and for one behind --config that is no
    KEY=VALUE: snakemake would end with a traceback."""
    known, settings = rule_names(), False
    for word in arguments:
        near = difflib.get_close_matches(word, known, n=1, cutoff=0.8)
        if word not in known and near:
            raise CalibrationError(f"{word}: is no stage; did you mean {near[0]}?")
        if word.startswith("-"):
            settings = word in ("--config", "-C")
        elif settings and "=" not in word:
            raise CalibrationError(
                f"{word}: is no setting; allowed behind --config: KEY=VALUE (a stage stands before)"
            )


def _verify(args):
    from calibration.runs.store import RunStore
    from calibration.runs.verify import faults_of, hold, repair

    if not args.results.is_dir():
        raise CalibrationError(f"{args.results}: is no folder")
    if args.repair:
        hold(args.results)
    faults = list(faults_of(args.results))
    for fault in faults:
        print(fault)
    runs = RunStore(args.results / "runs").names()
    print(f"{args.results}: {len(runs)} runs, {len(faults)} faults")
    if args.repair:
        repair(faults, args.results)
        print("set aside; `calibration run` makes again what a study needs of it")
    return 1 if faults and not args.repair else 0


if __name__ == "__main__":
    sys.exit(main())
