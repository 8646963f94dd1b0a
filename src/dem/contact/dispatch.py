"""The choice of a law inside the kernels, written out from what the laws declare.

For each role one function that asks for the number of the law and calls its kernel, as a row of `if
codes.slot == 1`. A branch on a code is the same for all contacts and costs nothing. Kernels handed
over as closures would miss numba's disk cache. The source is the same in every process: laws come
in the order of `catalogue`.
"""

from inspect import signature
from typing import TYPE_CHECKING, Any

from dem.contact.catalogue import CODES, LAWS
from dem.contact.law import ROLES
from dem.kernel.arithmetic import law

OTHERWISE = {
    "damped": "elastic, deepest",
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
    """[(slot, code, kernel)] of every law with the role."""
    return [
        (slot, CODES[slot][name], one.kernels[role])
        for slot in FIRST.get(role, LAWS)
        for name, one in LAWS[slot].items()
        if role in one.kernels
    ]


def source_of(role: str) -> str:
    """Python source of the function that chooses among the laws with a role; it hands each kernel
    the arguments that this names."""
    calls = [
        (slot, code, f"{slot}_{code}_{role}({', '.join(signature(kernel.py_func).parameters)})")
        for slot, code, kernel in _players(role)
    ]
    last = OTHERWISE[role] if role in OTHERWISE else calls.pop()[2]
    lines = [f"    if codes.{slot} == {code}:\n        return {call}" for slot, code, call in calls]
    return "\n".join([f"def {role}(codes, {ROLES[role]}):", *lines, f"    return {last}\n"])


def _compiled():
    kernels = {f"{slot}_{k}_{role}": kernel for role in ROLES for slot, k, kernel in _players(role)}
    spanning = [f"codes.{slot} == {code}" for slot, code, _ in _players("reach")] or ["False"]
    spans_gap = f"def spans_gap(codes):\n    return {' or '.join(spanning)}\n"
    scope = {"__name__": __name__} | kernels
    for text in (*map(source_of, ROLES), spans_gap):
        exec(compile(text, "<dispatch>", "exec"), scope)
    return {name: law(scope[name]) for name in (*ROLES, "spans_gap")}


if TYPE_CHECKING:

    def __getattr__(role: str) -> Any: ...


globals().update(_compiled())
