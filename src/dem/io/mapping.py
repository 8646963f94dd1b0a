"""YAML files as mappings, with the line of each key, so that an error can say where it is."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from dem.errors import InputError, SpecError
from dem.tables.limits import read_limited

FAULTS = (yaml.YAMLError, ValueError, ArithmeticError, LookupError, AttributeError, TypeError)
"""Of PyYAML: a tag such as !!bool on a value that is none comes out as one of the others."""
LARGEST = 100_000  # values of a file, those that it repeats by aliases counted each time


def read_mapping(path: str | Path) -> tuple[Any, dict[str, int]]:
    """(data, lines): content of a YAML file and {dotted key: line number, from 1}.

    Raises SpecError for a file that cannot be read, is larger than a configuration
    (`dem.tables.limits`), is not YAML, gives a key twice (YAML would keep
    the last in silence), or multiplies by aliases.
    """
    try:
        text = read_limited(path, "configuration").decode("utf-8")
    except InputError as error:
        value, allowed = error.value or error.reason, error.allowed or "a readable file"
        raise SpecError("(file)", value, allowed, path) from None
    except ValueError:
        raise SpecError("(file)", "bytes that are no text", "UTF-8", path) from None
    return parse_mapping(text, path)


def parse_mapping(text: str, path: str | Path) -> tuple[Any, dict[str, int]]:
    """As `read_mapping`, of a text; `path` is named in errors. Raises SpecError."""
    try:
        loader = yaml.SafeLoader(text)
        node = loader.get_single_node()
        if node is None:
            return None, {}
        if _size(node, {}, set()) > LARGEST:
            raise SpecError("(file)", "aliases", f"at most {LARGEST} values in all", path)
        lines = {}  # type: dict[str, int]
        _collect(path, node, "", lines)
        return loader.construct_document(node), lines
    except (*FAULTS, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f"{path}, line {mark.line + 1}" if mark else str(path)
        problem = getattr(error, "problem", None) or (str(error).splitlines() or [""])[0]
        raise SpecError("(file)", problem, "a YAML mapping", where) from None


def _size(node, known, above):
    """Number of values below a node; `known` {id: size} counts what is shared once, `above` finds
    endless aliases."""
    if id(node) in above:
        raise ValueError("an alias holds itself")
    if id(node) not in known:
        inside, below = above | {id(node)}, 0
        for part in node.value if isinstance(node, yaml.CollectionNode) else ():
            pair = part if isinstance(part, tuple) else (part,)
            below += sum(_size(p, known, inside) for p in pair)
        known[id(node)] = 1 + below
    return known[id(node)]


def line_of(key: str, lines: Mapping[str, int]) -> int | None:
    """Line of a dotted key, or of the nearest key above it that the file holds. None if it holds
    none."""
    parts = key.split(".")
    while parts and ".".join(parts) not in lines:
        parts.pop()
    return lines.get(".".join(parts))


def _collect(path, node, prefix, lines):
    """Fill `lines` from the mappings below `node`, of which none holds itself."""
    if not isinstance(node, yaml.MappingNode):
        return
    seen = {}
    for key, value in node.value:
        line = key.start_mark.line + 1
        name = f"{prefix}{key.value}"
        if name in seen:
            allowed = f"each key once; it was given on line {seen[name]}"
            raise SpecError(name, getattr(value, "value", None), allowed, f"{path}, line {line}")
        seen[name] = line
        _collect(path, value, f"{name}.", lines)
    lines.update(seen)
