"""SIMD lanes for numba: a number type that holds `WIDTH` contacts at a time.

A force law written with `+ - * /`, comparisons, `&`, `|` and the functions of
`dem.kernel.arithmetic` compiles unchanged for plain floats (the float64 reference path) and for
lanes (the fast path): numba picks the implementation by type. Nothing here knows any physics.

`F32` is a vector of `WIDTH` float32, `F64` of `WIDTH` float64, `MASK` of `WIDTH` booleans. A scalar
that meets lanes is broadcast.
"""

import functools
import inspect
import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, overload, register_model

from dem.kernel.arithmetic import any_lane, maximum, minimum, narrow, power, sqrt, where, widen

WIDTH = 16
"""Contacts per vector: one register of AVX-512, two of AVX2. A contact is a long chain of steps of
which each waits for the last; two registers of contacts wait at the same time."""

ROW = 8
"""Numbers in a row of a grain's motion or force; eight float32 fill one register of AVX."""

FIELDS = 9
"""Numbers per contact in a block of memory: the width of a contact's history and of the stage of
the walls."""

_CONTRACT = ("contract", "nsz")  # a*b + c may become one fused operation


class LaneType(types.Type):
    """Type of a vector of `width` elements."""

    def __init__(self, name, element, width, mask=None):
        self.vector, self.mask = ir.VectorType(element, width), mask
        super().__init__(name=f"lanes_{name}")


MASK = LaneType("mask", ir.IntType(1), WIDTH)
F32 = LaneType("f32", ir.FloatType(), WIDTH, MASK)
F64 = LaneType("f64", ir.DoubleType(), WIDTH, MASK)
ROW_MASK = LaneType("row_mask", ir.IntType(1), ROW)
ROW_F32 = LaneType("row_f32", ir.FloatType(), ROW, ROW_MASK)
FLOATS = (F32, F64, ROW_F32)


@register_model(LaneType)
class _LaneModel(models.PrimitiveModel):
    def __init__(self, manager, fe_type):
        super().__init__(manager, fe_type, fe_type.vector)


def broadcast(builder: Any, value: Any, lane_type: Any) -> Any:
    """Return `value` as a vector of `lane_type`; a scalar float fills every lane."""
    if isinstance(value.type, ir.VectorType):
        return value
    vector = lane_type.vector
    if isinstance(vector.element, ir.FloatType) and isinstance(value.type, ir.DoubleType):
        value = builder.fptrunc(value, vector.element)
    elif isinstance(vector.element, ir.DoubleType) and isinstance(value.type, ir.FloatType):
        value = builder.fpext(value, vector.element)
    index = ir.Constant(ir.IntType(32), 0)
    first = builder.insert_element(ir.Constant(vector, ir.Undefined), value, index)
    spread = ir.Constant(ir.VectorType(ir.IntType(32), vector.count), [0] * vector.count)
    return builder.shuffle_vector(first, ir.Constant(vector, ir.Undefined), spread)


def _for_lanes(op, emit, cases):
    """Compile `op` for `cases`, types (result, *arguments), as `emit` (builder, *vectors) has it; a
    scalar fills every lane."""
    for _, *kinds in cases:
        lane = next((kind for kind in kinds if kind in FLOATS), None)

        def lower(context, builder, sig, args, lane=lane):
            return emit(builder, *(broadcast(builder, value, lane) for value in args))

        lower_builtin(op, *kinds)(lower)
    typed = {"cases": [signature(*case) for case in cases]}
    infer_global(op)(type(f"_Lane_{op.__name__}", (ConcreteTemplate,), typed))


PAIRS = [
    (lane, *two)
    for lane in FLOATS
    for two in ((lane, lane), (lane, types.float64), (types.float64, lane))
]
"""(lane, two arguments of which one may be a scalar)."""

for _op, _method in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _for_lanes(_op, lambda b, x, y, m=_method: getattr(b, m)(x, y, flags=_CONTRACT), PAIRS)
for _op, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
):
    masks = [(lane.mask, x, y) for lane, x, y in PAIRS]
    _for_lanes(_op, lambda b, x, y, s=_sign: b.fcmp_ordered(s, x, y), masks)


def _vector_intrinsic(builder, name, value, *more):
    """Call an LLVM vector intrinsic such as `llvm.sqrt` on vectors of one type."""
    element = "f32" if value.type.element == ir.FloatType() else "f64"
    kind = ir.FunctionType(value.type, [value.type] * (1 + len(more)))
    function = cgutils.get_or_insert_function(
        builder.module, kind, f"llvm.{name}.v{value.type.count}{element}"
    )
    return builder.call(function, [value, *more])


def _any(builder, mask):
    bits = builder.bitcast(mask, ir.IntType(mask.type.count))
    return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))


_for_lanes(operator.and_, lambda b, x, y: b.and_(x, y), [(MASK, MASK, MASK)])
_for_lanes(operator.or_, lambda b, x, y: b.or_(x, y), [(MASK, MASK, MASK)])
_for_lanes(operator.neg, lambda b, x: b.fneg(x), [(F32, F32), (F64, F64)])
_for_lanes(sqrt, lambda b, x: _vector_intrinsic(b, "sqrt", x), [(F32, F32), (F64, F64)])
_for_lanes(
    power,
    lambda b, x, exponent: _vector_intrinsic(b, "pow", x, exponent),
    [(lane, lane, types.float64) for lane in (F32, F64)],
)
_for_lanes(
    where,
    lambda b, mask, x, y: b.select(mask, x, y),
    [(lane, lane.mask, x, y) for lane, x, y in PAIRS],
)
_for_lanes(narrow, lambda b, x: b.fptrunc(x, F32.vector), [(F32, F64)])
_for_lanes(widen, lambda b, x: b.fpext(x, F64.vector), [(F64, F32)])
_for_lanes(any_lane, _any, [(types.boolean, MASK), (types.boolean, ROW_MASK)])


def _in_lanes(kind):
    """Return whether a type is one of the fast path: lanes, an array of float32, or a tuple that
    has one."""
    if isinstance(kind, types.BaseTuple):
        return any(map(_in_lanes, kind.types))
    return isinstance(kind, LaneType) or getattr(kind, "dtype", None) == types.float32


def fast_path(plain: Callable, **options: Any) -> Callable:
    """Decorator of what compiled code calls in place of `plain` where it is given float32 or lanes;
    for float64 `plain` itself is compiled. options: numba's, for both."""

    def choose(fast):
        overload(plain, jit_options={"error_model": "numpy"} | options, strict=False)(
            lambda *kinds: fast if any(map(_in_lanes, kinds)) else plain
        )
        return fast

    return choose


for _function in (sqrt, power, where, narrow, widen, any_lane):
    fast_path(_function, forceinline=True)(None)  # the forms for lanes are those above


@overload(maximum, jit_options={"forceinline": True})
def _maximum(a, b):
    return lambda a, b: where(a > b, a, b)


@overload(minimum, jit_options={"forceinline": True})
def _minimum(a, b):
    return lambda a, b: where(a < b, a, b)


def emits(returns: Any) -> Callable:
    """Decorator of a function that writes what is compiled for a call: (context, builder, types of
    the arguments, *arguments) -> LLVM's value, or a list of them for a tuple, or None. returns:
    numba's type of the result."""

    def register(emit):
        def codegen(context, builder, sig, args):
            made = emit(context, builder, sig.args, *args)
            if isinstance(made, list):
                return context.make_tuple(builder, sig.return_type, made)
            return context.get_dummy_value() if made is None else made

        @functools.wraps(emit)
        def typed(typingctx, *kinds):
            return returns(*kinds), codegen

        _, *of_call = inspect.signature(emit).parameters.values()
        typed.__signature__ = inspect.Signature(of_call[1:])  # type: ignore[attr-defined]
        return intrinsic(typed)

    return register


# --- memory ---------------------------------------------------------------------------------------
# Particle rows are 64 bytes: four float64 (x, y, z, radius) and eight float32. Gathering
# loads whole rows and transposes them in registers, which costs a third of the hardware gather
# instruction.


def place_in(context: Any, builder: Any, array_type: Any, array: Any, index: Any) -> Any:
    """Pointer to number `index`, int64, of a contiguous array."""
    return builder.gep(context.make_array(array_type)(context, builder, array).data, [index])


def _load(builder, pointer, vector, align):
    load = builder.load(builder.bitcast(pointer, vector.as_pointer()))
    load.align = align
    return load


def _constant(n):
    return ir.Constant(ir.IntType(64), n)


def _shuffle(builder, a, b, mask):
    """Elements of a and b, numbered on through both."""
    return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(ir.IntType(32), len(mask)), mask))


def _join(builder, parts):
    """Vectors of one length, one behind the other as one vector."""
    while len(parts) > 1:
        mask = list(range(2 * parts[0].type.count))
        parts = [_shuffle(builder, a, b, mask) for a, b in zip(*[iter(parts)] * 2, strict=True)]
    return parts[0]


def _in_groups(builder, a, b, mask):
    """`_shuffle` of each group of as many elements as the mask is long, by itself."""
    size, whole = len(mask), a.type.count
    return _shuffle(
        builder,
        a,
        b,
        [
            start + k if k < size else whole + start + k - size
            for start in range(0, whole, size)
            for k in mask
        ],
    )


def _transpose(builder, rows):
    """Transpose 8 vectors of 8 in three rounds of interleaving; of longer vectors each group of 8
    elements by itself."""
    low, high = [0, 8, 1, 9, 4, 12, 5, 13], [2, 10, 3, 11, 6, 14, 7, 15]
    a = []
    for k in range(0, 8, 2):
        a += [_in_groups(builder, rows[k], rows[k + 1], m) for m in (low, high)]
    low, high = [0, 1, 8, 9, 4, 5, 12, 13], [2, 3, 10, 11, 6, 7, 14, 15]
    b = []
    for k in (0, 4):
        for h in (0, 1):
            b += [_in_groups(builder, a[k + h], a[k + h + 2], m) for m in (low, high)]
    low, high = [0, 1, 2, 3, 8, 9, 10, 11], [4, 5, 6, 7, 12, 13, 14, 15]
    out = [_in_groups(builder, b[k], b[k + 4], low) for k in range(4)]
    return out + [_in_groups(builder, b[k], b[k + 4], high) for k in range(4)]


def _indices(context, builder, array_type, array, start):
    """The `WIDTH` int32 indices from `start`, as 64-bit integers."""
    base = place_in(context, builder, array_type, array, start)
    places = [builder.gep(base, [_constant(lane)]) for lane in range(WIDTH)]
    return [builder.zext(builder.load(place), ir.IntType(64)) for place in places]


def _columns(builder, rows):
    """Eight vectors of `WIDTH` from the addresses of `WIDTH` rows of eight float32, aligned to 32
    bytes."""
    loaded = [_load(builder, row, ROW_F32.vector, 4 * ROW) for row in rows]
    return _transpose(builder, [_join(builder, loaded[k::8]) for k in range(8)])


@emits(types.UniTuple(F32, 8))
def gather_rows(context, builder, kinds, rows, index, start):
    """The eight F32 columns of rows `index[start:start+WIDTH]` of rows (n, 8) float32, aligned to
    32 bytes, which may lie apart; index (m,) int32."""
    index = _indices(context, builder, kinds[1], index, start)
    places = [_row(context, builder, kinds[0], rows, k, ROW_F32.vector) for k in index]
    return _columns(builder, places)


def _pair_rows(builder, double, i, j, combine):
    """Return what `combine` makes of the position rows of the pairs i, j, four float64 each, as
    vectors of `WIDTH`, eight pairs at a time in groups of four: one for each of the four
    numbers."""
    four, made = ir.VectorType(ir.DoubleType(), 4), []
    for pair in zip(i, j, strict=True):
        places = [builder.gep(double, [builder.mul(k, _constant(8))]) for k in pair]
        made.append(combine(*(_load(builder, place, four, 32) for place in places)))
    eights = []
    for h in range(0, WIDTH, 8):
        r = [_join(builder, [made[h + k], made[h + k + 4]]) for k in range(4)]
        even, odd = [0, 4, 2, 6], [1, 5, 3, 7]
        a0, a1 = (_in_groups(builder, r[0], r[1], m) for m in (even, odd))
        b0, b1 = (_in_groups(builder, r[2], r[3], m) for m in (even, odd))
        low, high = [0, 1, 4, 5], [2, 3, 6, 7]
        x, z = (_in_groups(builder, a0, b0, m) for m in (low, high))
        y, w = (_in_groups(builder, a1, b1, m) for m in (low, high))
        eights.append((x, y, z, w))
    return [_join(builder, list(parts)) for parts in zip(*eights, strict=True)]


@emits(types.UniTuple(F64, 4))
def gather_separations(context, builder, kinds, rows, first, second, start):
    """(dx, dy, dz) as `gather_pairs` has it, and the sum of the radii, F64; far less than all that
    a contact needs."""
    double = place_in(context, builder, kinds[0], rows, _constant(0))
    i = _indices(context, builder, kinds[1], first, start)
    j = _indices(context, builder, kinds[2], second, start)

    def difference_and_sum(a, b):
        return _shuffle(builder, builder.fsub(a, b), builder.fadd(a, b), [0, 1, 2, 7])

    return _pair_rows(builder, double, i, j, difference_and_sum)


@emits(types.Tuple([F64] * 3 + [F32] * 16))
def gather_pairs(context, builder, kinds, rows, first, second, start):
    """Load `WIDTH` pairs of particle rows.

    Parameters: rows (n, 8) float64 buffer of 64-byte rows; first, second (m,) int32; start: first
    pair.
    Returns (dx, dy, dz) = position of first minus position of second, F64, then the eight F32
    columns of the first particle and the eight of the second.
    """
    double = place_in(context, builder, kinds[0], rows, _constant(0))
    single = builder.bitcast(double, ir.FloatType().as_pointer())
    i = _indices(context, builder, kinds[1], first, start)
    j = _indices(context, builder, kinds[2], second, start)
    values = _pair_rows(builder, double, i, j, builder.fsub)[:3]
    for index in (i, j):
        places = [builder.add(builder.mul(k, _constant(16)), _constant(8)) for k in index]
        values += _columns(builder, [builder.gep(single, [k]) for k in places])
    return values


@emits(types.none)
def scatter_add(context, builder, kinds, target, index, start, columns):
    """Add eight lane columns to rows `index[start:start+WIDTH]` of target (n, 8) float32, one lane
    after the other.

    Lanes are added in order, so a particle that stands in several lanes receives every share.
    """
    base = place_in(context, builder, kinds[0], target, _constant(0))
    index = _indices(context, builder, kinds[1], index, start)
    groups = _transpose(builder, [builder.extract_value(columns, k) for k in range(8)])
    rows = [
        _shuffle(builder, group, group, list(range(first, first + 8)))
        for first in range(0, WIDTH, 8)
        for group in groups
    ]
    for k, row in zip(index, rows, strict=True):
        place = builder.gep(base, [builder.mul(k, _constant(8))])
        old = _load(builder, place, ROW_F32.vector, 32)
        place = builder.bitcast(place, ROW_F32.vector.as_pointer())
        builder.store(builder.fadd(old, row), place).align = 32


def _field(context, builder, array_type, array, block, k):
    """Pointer to field k of block `block` of blocks (m, FIELDS, WIDTH) float32."""
    row = builder.add(builder.mul(block, _constant(FIELDS)), k)
    place = place_in(context, builder, array_type, array, builder.mul(row, _constant(WIDTH)))
    return builder.bitcast(place, F32.vector.as_pointer())


@emits(F32)
def load_field(context, builder, kinds, blocks, block, field):
    """Field `field` of block `block` of blocks (m, FIELDS, WIDTH) float32, as F32."""
    return _load(
        builder, _field(context, builder, kinds[0], blocks, block, field), F32.vector, 4 * WIDTH
    )


@emits(types.UniTuple(F32, FIELDS))
def load_block(context, builder, kinds, blocks, block):
    """All fields of block `block` of blocks (m, FIELDS, WIDTH) float32 as FIELDS F32."""
    places = [
        _field(context, builder, kinds[0], blocks, block, _constant(k)) for k in range(FIELDS)
    ]
    return [_load(builder, place, F32.vector, 4 * WIDTH) for place in places]


@emits(types.none)
def store_block(context, builder, kinds, blocks, block, fields):
    """Store the F32 of a tuple into the first fields of block `block` of blocks (m, FIELDS, WIDTH)
    float32."""
    for k in range(len(kinds[2])):
        pointer = _field(context, builder, kinds[0], blocks, block, _constant(k))
        builder.store(builder.extract_value(fields, k), pointer).align = 4 * WIDTH


@emits(F32)
def load_lanes(context, builder, kinds, values, start):
    """values[start : start + WIDTH] of a (m,) float32 as F32."""
    return _load(builder, place_in(context, builder, kinds[0], values, start), F32.vector, 4)


@emits(types.int64)
def bits_of(context, builder, kinds, mask):
    """A mask as an int64: bit k is lane k."""
    return builder.zext(builder.bitcast(mask, ir.IntType(WIDTH)), ir.IntType(64))


@emits(types.int64)
def lowest_bit(context, builder, kinds, bits):
    """Number of the lowest bit that is set; bits must not be 0."""
    return builder.cttz(bits, ir.Constant(ir.IntType(1), 1))


inlined = njit(forceinline=True, error_model="numpy")
"""Decorator of a kernel's part that takes named tuples of arrays: a real call would copy kilobytes
of pointers."""


@inlined
def column(block, lane):
    """Lane `lane` of a block (FIELDS, WIDTH) as FIELDS numbers."""
    b, k = block, lane
    return b[0, k], b[1, k], b[2, k], b[3, k], b[4, k], b[5, k], b[6, k], b[7, k], b[8, k]


# --- one row at a time ----------------------------------------------------------------------------
# A particle's motion is one vector too: velocity in lanes 0-2, spin in 3-5, radius and mass beyond.


def _row(context, builder, array_type, array, index, vector):
    """Pointer to row `index` of a (n, k) array whose rows may lie apart, as one vector."""
    view = context.make_array(array_type)(context, builder, array)
    if array_type.layout == "C":  # a row is a vector then
        return builder.gep(builder.bitcast(view.data, vector.as_pointer()), [index])
    stride = cgutils.unpack_tuple(builder, view.strides, 2)[0]
    raw = builder.bitcast(view.data, ir.IntType(8).as_pointer())
    start = builder.gep(raw, [builder.mul(index, stride)])
    return builder.bitcast(start, vector.as_pointer())


@emits(ROW_F32)
def load_row(context, builder, kinds, rows, index):
    """Row `index` of rows (n, 8) float32, aligned to 32 bytes, as ROW_F32."""
    place = _row(context, builder, kinds[0], rows, index, ROW_F32.vector)
    return _load(builder, place, ROW_F32.vector, 4 * ROW)


@emits(types.none)
def store_row(context, builder, kinds, rows, index, values):
    """Store a ROW_F32 as row `index` of rows (n, 8) float32, aligned to 32 bytes."""
    pointer = _row(context, builder, kinds[0], rows, index, ROW_F32.vector)
    builder.store(values, pointer).align = 4 * ROW


@emits(ROW_F32)
def spread(context, builder, kinds, linear, angular):
    """ROW_F32 with `linear` in lanes 0-2, `angular` in 3-5 and 0 in 6 and 7; both float32."""
    one, other = (broadcast(builder, a, ROW_F32) for a in (linear, angular))
    both = _shuffle(builder, one, other, [0, 1, 2, 11, 12, 13, 6, 7])
    zero = ir.Constant(both.type, [0.0] * ROW)
    return _shuffle(builder, both, zero, [0, 1, 2, 3, 4, 5, 14, 15])


@emits(ROW_F32)
def linear_lanes(context, builder, kinds, x, y, z):
    """ROW_F32 with three float32 in lanes 0-2 and 0 beyond."""
    out = ir.Constant(ROW_F32.vector, [0.0] * ROW)
    for k, value in enumerate((x, y, z)):
        out = builder.insert_element(out, value, ir.Constant(ir.IntType(32), k))
    return out


def _sum_of_squares(builder, values, lanes):
    total = None
    for k in lanes:
        value = builder.extract_element(values, ir.Constant(ir.IntType(32), k))
        square = builder.fmul(value, value, flags=_CONTRACT)
        total = builder.fadd(total, square, flags=_CONTRACT) if total else square
    return total


@emits(types.float32)
def angular_square(context, builder, kinds, values):
    """Sum of the squares of lanes 3-5 of a ROW_F32, a float32."""
    return _sum_of_squares(builder, values, (3, 4, 5))


@emits(types.boolean)
def move_row(context, builder, kinds, position, drift, index, step):
    """Add lanes 0-2 of the ROW_F32 `step`, whose lane 3 is 0, to a row of position (n, 4) float64
    and of drift (n, 4) float32; True when the drift's square exceeds its fourth number."""
    four = _shuffle(builder, step, step, [0, 1, 2, 3])
    wide, single = (ir.VectorType(t, 4) for t in (ir.DoubleType(), ir.FloatType()))
    place = _row(context, builder, kinds[0], position, index, wide)
    moved = builder.fadd(_load(builder, place, wide, 32), builder.fpext(four, wide))
    builder.store(moved, place).align = 32
    place = _row(context, builder, kinds[1], drift, index, single)
    after = builder.fadd(_load(builder, place, single, 16), four)
    builder.store(after, place).align = 16
    limit = builder.extract_element(after, ir.Constant(ir.IntType(32), 3))
    return builder.fcmp_ordered(">", _sum_of_squares(builder, after, (0, 1, 2)), limit)
