"""A row of the property table inside the kernels: each constant is read where a law asks for it.

`p.friction` compiles to one load in the branch of the law that reads it. So the constants of laws
that are not chosen cost nothing, however many they are.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import lower_getattr_generic, models, register_model

from dem.contact.registry import PairProperties
from dem.kernel.simd import emits, place_in


class PropertyRow(types.Type):
    """Type of a row: the address of its first number."""

    def __init__(self):
        super().__init__(name="property_row")


ROW = PropertyRow()


@register_model(PropertyRow)
class _RowModel(models.PrimitiveModel):
    def __init__(self, manager, fe_type):
        super().__init__(manager, fe_type, ir.DoubleType().as_pointer())


@infer_getattr
class _RowAttributes(AttributeTemplate):
    key = PropertyRow

    def generic_resolve(self, row: Any, name: str) -> Any:  # type: ignore[override]
        return types.float64 if name in PairProperties._fields else None


@lower_getattr_generic(PropertyRow)
def _load(context, builder, kind, row, name):
    place = ir.Constant(ir.IntType(64), PairProperties._fields.index(name))
    load = builder.load(builder.gep(row, [place]))
    load.set_metadata("invariant.load", builder.module.add_metadata([]))
    return load


@emits(ROW)
def properties_of(context, builder, kinds, table, pair):
    """Row `pair` of table (n_pairs, N_PROPERTIES) float64, C-contiguous, whose numbers are
    attributes named as in `PairProperties`. The table must outlive it and not change meanwhile."""
    pair = context.cast(builder, pair, kinds[1], types.int64)
    width = ir.Constant(ir.IntType(64), len(PairProperties._fields))
    return place_in(context, builder, kinds[0], table, builder.mul(pair, width))
