"""Every law there is: the files in the folders of the slots, read in the order of their names."""

from importlib import import_module
from pathlib import Path

SLOTS = (
    "normal",
    "damping",
    "tangential",
    "friction",
    "rolling",
    "torsion",
    "cohesion",
    "drag",
)


def _read(slot):
    """{name: Law} of a slot, its default first."""
    found = {}
    for file in sorted((Path(__file__).parent / slot).glob("*.py")):
        if file.stem == "__init__":
            continue
        law = import_module(f"dem.contact.{slot}.{file.stem}").LAW
        assert (law.slot, law.name) == (slot, file.stem), f"{file}: declares {law.slot}.{law.name}"
        found[law.name] = law
    return dict(sorted(found.items(), key=lambda item: not item[1].default))


LAWS = {slot: _read(slot) for slot in SLOTS}
"""Slot -> {name: Law}; the first of each is the default."""

CODES = {slot: {name: k for k, name in enumerate(laws)} for slot, laws in LAWS.items()}
"""Slot -> {name: number of the law inside the kernels}."""


def every_law():
    """All `Law`s, slot by slot."""
    return [law for laws in LAWS.values() for law in laws.values()]


def groups_needed(law):
    """Groups of keys of `law_parameters` of which at least one must be given."""
    return [
        (p.key, f"wall_{p.key}") if p.wall else (p.key,)
        for p in law.parameters
        if p.default is None
    ]


def keys_allowed(law):
    """Keys of `law_parameters` that have a default."""
    return [
        key
        for p in law.parameters
        if p.default is not None
        for key in ((p.key, f"wall_{p.key}") if p.wall else (p.key,))
    ]


def table():
    """Markdown table of all laws, for the documentation."""
    lines = ["| slot | law | equation | source |", "|---|---|---|---|"]
    for slot, laws in LAWS.items():
        for k, law in enumerate(laws.values()):
            lines.append(f"| {'' if k else slot} | `{law.name}` | {law.equation} | {law.source} |")
    return "\n".join(lines)
