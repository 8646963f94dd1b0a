"""The commands that `commands.yaml` declares, as those of a parser."""

import argparse
from collections.abc import Callable
from functools import partial
from importlib.resources import files
from pkgutil import resolve_name
from typing import Any

import yaml

from dem import cli


def add_commands(
    commands: Any, program: str, own: dict[str, Callable[[argparse.Namespace], Any]]
) -> None:
    """Add a program's commands to `commands`, what `add_subparsers` gives; own: {command: its
    function of the parsed arguments} where the table names none."""
    text = files("calibration.interface").joinpath("commands.yaml").read_text("utf-8")
    told = yaml.safe_load(text)[program]

    def command_of(name, given):
        function = told[name].get("function")
        return partial(_print_of, function, given) if function else own[name]

    cli.add_commands(commands, told, command_of)


def _print_of(function, given, args):
    """Print the lines that a function gives of the options by name. It is loaded now: most of them
    bring large libraries along."""
    print(*resolve_name(function)(**{name: getattr(args, name) for name in given}), sep="\n")
