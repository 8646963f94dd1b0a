"""The commands that `commands.yaml` declares, as those of a parser."""

import argparse
from collections.abc import Callable
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
        if function is None:
            return own[name]

        def lines(args):
            # the function is loaded now: most of them bring large libraries along
            return resolve_name(function)(**{option: getattr(args, option) for option in given})

        return lambda args: print(*lines(args), sep="\n")

    cli.add_commands(commands, told, command_of)
