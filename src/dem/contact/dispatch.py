"""The choice of a law inside the kernels, written out from what the laws declare.

For each role one function that asks for the number of the law and calls its kernel, as a row of `if
codes.slot == 1`. A branch on a code is the same for all contacts and costs nothing. Kernels handed
over as closures would miss numba's disk cache. The source is the same in every process: laws come
in the order of `catalogue`.
"""

import sys
from inspect import signature
from typing import TYPE_CHECKING, Any

from dem.contact.catalogue import CODES, LAWS
from dem.contact.law import ROLES
from dem.kernel.arithmetic import law

OTHERWISE = {
    "attraction": "0.0 * r_eff",
    "reach": "0.0 * r_eff",
    "rolling": "(0.0 * r_eff, 0.0 * r_eff, 0.0 * r_eff), spring",
    "resistance": "0.0 * radius",
    "torsion": "0.0 * limit, 0.0 * limit",
}
"""Role -> what a contact without such a law has; in the others one law is always chosen."""

FIRST = {"normal": ("cohesion", "normal")}
"""Role -> slots in the order they are asked, where laws of two slots play it."""


def _players(role):
    """(slot, code, call of the kernel with the arguments that it names) of every law with the
    role."""
    slots = FIRST.get(role, LAWS)
    return [
        (slot, CODES[slot][name], f"{slot}_{name}.{_call(one.kernels[role])}")
        for slot in slots
        for name, one in LAWS[slot].items()
        if role in one.kernels
    ]


def _call(kernel):
    return f"{kernel.__name__}({', '.join(signature(kernel.py_func).parameters)})"


def source_of(role: str) -> str:
    """Python source of the function that chooses among the laws with a role."""
    lines, players = [f"def {role}(codes, {ROLES[role]}):"], _players(role)
    for k, (slot, code, call) in enumerate(players):
        if k + 1 == len(players) and role not in OTHERWISE:
            lines += ["    else:", f"        return {call}"] if k else [f"    return {call}"]
        else:
            lines += [
                f"    {'el' if k else ''}if codes.{slot} == {code}:",
                f"        return {call}",
            ]
    if role in OTHERWISE:
        lines.append(f"    return {OTHERWISE[role]}")
    return "\n".join(lines) + "\n"


def _spans_source():
    codes = [f"codes.{slot} == {code}" for slot, code, _ in _players("reach")]
    return f"def spans_gap(codes):\n    return {' or '.join(codes) or 'False'}\n"


def _compiled():
    modules = {
        f"{slot}_{name}": sys.modules[f"dem.contact.{slot}.{name}"]
        for slot, laws in LAWS.items()
        for name in laws
    }
    scope = {"__name__": __name__} | modules
    for text in (*map(source_of, ROLES), _spans_source()):
        exec(compile(text, "<dispatch>", "exec"), scope)
    return {name: law(scope[name]) for name in (*ROLES, "spans_gap")}


if TYPE_CHECKING:

    def __getattr__(role: str) -> Any: ...


globals().update(_compiled())
