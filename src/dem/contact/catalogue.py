"""Every law there is: the files in the folders of the slots, read in the order of their names."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dem.contact.law import Law


SLOTS = ("normal", "damping", "tangential", "friction", "rolling", "torsion", "cohesion", "drag")


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

DEFAULTS = {slot: next(iter(laws)) for slot, laws in LAWS.items()}
"""Slot -> name of the law where none is named. Rolling and torsion are a pair that conserves
angular momentum."""


def completed(named: Mapping[str, str]) -> dict[str, str]:
    """{slot: name of its law} of all slots, in their order, from those that are named.

    A choice that names a rolling law and no torsion has none: that of `constant_torque` brakes all
    of a grain's spin, so that a torsion beside it would brake the spin about the normal twice. Nor
    has one with laws that no torsion goes with.
    """
    found = DEFAULTS | {slot: name for slot, name in named.items() if slot in SLOTS}
    refused = any("torsion" in (slot, other) for slot, _, other, *_ in clashes(found))
    if "torsion" not in named and ("rolling" in named or refused):
        found["torsion"] = "none"
    return {slot: found[slot] for slot in SLOTS}


def clashes(chosen: Mapping[str, str]) -> list[tuple[str, str, str, str, str]]:
    """(slot, name, other slot, its name, what it may be) of laws that cannot be combined, of a
    choice {slot: name} of all slots; unknown names make none."""
    found = []
    for law in (LAWS[slot][name] for slot, name in chosen.items() if name in LAWS[slot]):
        beside = {slot: [n for n in LAWS[slot] if n not in no] for slot, no in law.not_with.items()}
        for other, allowed in (*law.only_with.items(), *beside.items()):
            if chosen[other] not in allowed:
                words = " or ".join(allowed)
                found.append((law.slot, law.name, other, chosen[other], words))
    return found


CODES = {slot: {name: k for k, name in enumerate(laws)} for slot, laws in LAWS.items()}
"""Slot -> {name: number of the law inside the kernels}."""


def every_law() -> list[Law]:
    """All `Law`s, slot by slot."""
    return [law for laws in LAWS.values() for law in laws.values()]


def groups_needed(law: Law) -> list[tuple[str, ...]]:
    """Groups of keys of `law_parameters` of which at least one must be given."""
    return [p.keys for p in law.parameters if p.default is None]


def keys_allowed(law: Law) -> list[str]:
    """Keys of `law_parameters` that have a default."""
    return [key for p in law.parameters if p.default is not None for key in p.keys]


def table() -> str:
    """Markdown table of all laws, for the documentation."""
    lines = ["| slot | law | equation | source |", "|---|---|---|---|"]
    for slot, laws in LAWS.items():
        for k, law in enumerate(laws.values()):
            lines.append(f"| {'' if k else slot} | `{law.name}` | {law.equation} | {law.source} |")
    return "\n".join(lines)
