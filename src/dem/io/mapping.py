"""YAML files as mappings, with the line of each key, so that an error can say where it is."""

from pathlib import Path

import yaml

from dem.errors import SpecError


def read_mapping(path):
    """(data, lines): content of a YAML file and {dotted key: line number, from 1}.

    Raises SpecError for a file that cannot be read, is not YAML, or gives a key twice (YAML would keep the last in
    silence).
    """
    path = Path(path)
    try:
        loader = yaml.SafeLoader(path.read_text(encoding="utf-8"))
        node = loader.get_single_node()
        lines = {}
        if node is not None:
            _collect(path, node, "", lines, set())
        return loader.construct_document(node) if node is not None else None, lines
    except OSError as error:
        raise SpecError("(file)", str(path), f"a readable file ({error.strerror})") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f"{path}, line {mark.line + 1}" if mark else str(path)
        problem = getattr(error, "problem", None) or str(error).splitlines()[0]
        raise SpecError("(file)", problem, "a YAML mapping", where) from None


def line_of(key, lines):
    """Line of a dotted key, or of the nearest key above it that the file holds; None where it holds none."""
    parts = key.split(".")
    while parts and ".".join(parts) not in lines:
        parts.pop()
    return lines.get(".".join(parts))


def _collect(path, node, prefix, lines, above):
    """Fill `lines` from the mappings below `node`; `above`: nodes on the way here, against endless aliases."""
    if not isinstance(node, yaml.MappingNode) or id(node) in above:
        return
    seen = {}
    for key, value in node.value:
        line = key.start_mark.line + 1
        name = f"{prefix}{key.value}"
        if name in seen:
            allowed = f"each key once; it was given on line {seen[name]}"
            raise SpecError(name, getattr(value, "value", None), allowed, f"{path}, line {line}")
        seen[name] = line
        _collect(path, value, f"{name}.", lines, above | {id(node)})
    lines.update(seen)
