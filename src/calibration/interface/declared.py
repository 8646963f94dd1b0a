"""The commands that `commands.yaml` declares, as those of a parser."""

import argparse
from collections.abc import Callable
from functools import partial
from importlib.resources import files
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import yaml


def _whole(text):
    if not text.removeprefix("-").isdigit():
        raise argparse.ArgumentTypeError(f"{text} is no whole number, such as 10000")
    return int(text)


TYPES: dict[str, Any] = {"path": Path, "int": int, "float": float, "whole": _whole}


def add_commands(
    commands: Any, program: str, own: dict[str, Callable[[argparse.Namespace], Any]]
) -> None:
    """Add a program's commands to `commands`, what `add_subparsers` gives; own: {command: its
    function of the parsed arguments} where the table names none."""
    text = files("calibration.interface").joinpath("commands.yaml").read_text("utf-8")
    for name, told in yaml.safe_load(text)[program].items():
        parser = commands.add_parser(name, help=told["help"], description=told.get("description"))
        given = []
        for option, how in told["options"].items():
            kind = {"type": TYPES[how["type"]]} if "type" in how else {}
            given.append(parser.add_argument(option, **how | kind).dest)
        command = partial(_print_of, told["function"], given) if "function" in told else own[name]
        parser.set_defaults(command=command)


def _print_of(function, given, args):
    """Print the lines that a function gives of the options by name. It is loaded now: most of them
    bring large libraries along."""
    print(*resolve_name(function)(**{name: getattr(args, name) for name in given}), sep="\n")
