"""SIMD lanes for numba: a number type that holds `WIDTH` contacts at a time.

A force law written with `+ - * /`, comparisons, `&`, `|` and the functions of
`dem.kernel.arithmetic` compiles unchanged for plain floats (the float64 reference path) and for
lanes (the fast path): numba picks the implementation by type. Nothing here knows any physics.

`F32` is a vector of `WIDTH` float32, `F64` of `WIDTH` float64, `MASK` of `WIDTH` booleans. A scalar
that meets lanes is broadcast.
"""

import math
import operator
from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.core.errors import RequireLiteralValue
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


def _register_binary(op, emit, compares=False):
    cases = []
    for lane in (F32, F64, ROW_F32):
        out = lane.mask if compares else lane
        for pair in ((lane, lane), (lane, types.float64), (types.float64, lane)):
            cases.append(signature(out, *pair))

            def lower(context, builder, sig, args, lane=lane):
                return emit(builder, *(broadcast(builder, a, lane) for a in args))

            lower_builtin(op, *pair)(lower)
    infer_global(op)(type(f"_Lane_{op.__name__}", (ConcreteTemplate,), {"cases": cases}))


for _op, _method in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _register_binary(_op, lambda b, x, y, m=_method: getattr(b, m)(x, y, flags=_CONTRACT))
for _op, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
):
    _register_binary(_op, lambda b, x, y, s=_sign: b.fcmp_ordered(s, x, y), compares=True)


def _register_mask(op, method):
    def lower(context, builder, sig, args):
        return getattr(builder, method)(*args)

    lower_builtin(op, MASK, MASK)(lower)
    cases = [signature(MASK, MASK, MASK)]
    infer_global(op)(type(f"_Mask_{op.__name__}", (ConcreteTemplate,), {"cases": cases}))


_register_mask(operator.and_, "and_")
_register_mask(operator.or_, "or_")


@infer_global(operator.neg)
class _LaneNeg(ConcreteTemplate):
    cases = (signature(F32, F32), signature(F64, F64))


@lower_builtin(operator.neg, F32)
@lower_builtin(operator.neg, F64)
def _lower_neg(context, builder, sig, args):
    return builder.fneg(args[0])


def _vector_intrinsic(builder, name, value, *more):
    """Call an LLVM vector intrinsic such as `llvm.sqrt` on vectors of one type."""
    element = "f32" if value.type.element == ir.FloatType() else "f64"
    kind = ir.FunctionType(value.type, [value.type] * (1 + len(more)))
    function = cgutils.get_or_insert_function(
        builder.module, kind, f"llvm.{name}.v{value.type.count}{element}"
    )
    return builder.call(function, [value, *more])


@intrinsic
def _lane_sqrt(typingctx, x):
    def codegen(context, builder, sig, args):
        return _vector_intrinsic(builder, "sqrt", args[0])

    return x(x), codegen


@intrinsic
def _lane_power(typingctx, x, exponent):
    def codegen(context, builder, sig, args):
        power = broadcast(builder, args[1], sig.args[0])
        return _vector_intrinsic(builder, "pow", args[0], power)

    return x(x, exponent), codegen


@intrinsic
def _lane_where(typingctx, mask, a, b):
    out = a if isinstance(a, LaneType) else b

    def codegen(context, builder, sig, args):
        chosen = [broadcast(builder, v, sig.return_type) for v in args[1:]]
        return builder.select(args[0], *chosen)

    return out(mask, a, b), codegen


@intrinsic
def _lane_narrow(typingctx, x):
    def codegen(context, builder, sig, args):
        return builder.fptrunc(args[0], F32.vector)

    return F32(x), codegen


@intrinsic
def _lane_widen(typingctx, x):
    def codegen(context, builder, sig, args):
        return builder.fpext(args[0], F64.vector)

    return F64(x), codegen


@intrinsic
def _lane_any(typingctx, mask):
    def codegen(context, builder, sig, args):
        bits = builder.bitcast(args[0], ir.IntType(mask.vector.count))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(mask), codegen


def _is_lane(t):
    return isinstance(t, LaneType)


@overload(sqrt, jit_options={"forceinline": True})
def _sqrt(x):
    return (lambda x: _lane_sqrt(x)) if _is_lane(x) else (lambda x: math.sqrt(x))


@overload(power, jit_options={"forceinline": True})
def _power(x, exponent):
    if _is_lane(x):
        return lambda x, exponent: _lane_power(x, exponent)
    return lambda x, exponent: x**exponent


@overload(where, jit_options={"forceinline": True})
def _where(condition, a, b):
    if _is_lane(condition):
        return lambda condition, a, b: _lane_where(condition, a, b)
    return lambda condition, a, b: a if condition else b


@overload(maximum, jit_options={"forceinline": True})
def _maximum(a, b):
    return lambda a, b: where(a > b, a, b)


@overload(minimum, jit_options={"forceinline": True})
def _minimum(a, b):
    return lambda a, b: where(a < b, a, b)


@overload(narrow, jit_options={"forceinline": True})
def _narrow(x):
    return (lambda x: _lane_narrow(x)) if _is_lane(x) else (lambda x: x)


@overload(widen, jit_options={"forceinline": True})
def _widen(x):
    return (lambda x: _lane_widen(x)) if _is_lane(x) else (lambda x: x)


@overload(any_lane, jit_options={"forceinline": True})
def _any_lane(condition):
    return (
        (lambda condition: _lane_any(condition))
        if _is_lane(condition)
        else (lambda condition: condition)
    )


# --- memory ---------------------------------------------------------------------------------------
# Particle rows are 64 bytes: four float64 (x, y, z, radius) and eight float32. Gathering
# loads whole rows and transposes them in registers, which costs a third of the hardware gather
# instruction.


def _pointer(context, builder, array_type, array, element_type):
    data = context.make_array(array_type)(context, builder, array).data
    return builder.bitcast(data, element_type.as_pointer())


def _load(builder, base, offset, vector, align):
    pointer = builder.gep(base, [offset])
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
    base = _pointer(context, builder, array_type, array, ir.IntType(32))
    out = []
    for lane in range(WIDTH):
        pointer = builder.gep(base, [builder.add(start, _constant(lane))])
        out.append(builder.zext(builder.load(pointer), ir.IntType(64)))
    return out


def _columns(builder, rows):
    """Eight vectors of `WIDTH` from the addresses of `WIDTH` rows of eight float32, aligned to 32
    bytes."""
    loaded = []
    for row in rows:
        load = builder.load(builder.bitcast(row, ROW_F32.vector.as_pointer()))
        load.align = 4 * ROW
        loaded.append(load)
    return _transpose(builder, [_join(builder, loaded[k::8]) for k in range(8)])


@intrinsic
def gather_rows(typingctx, rows, index, start):
    """The eight F32 columns of rows `index[start:start+WIDTH]` of rows (n, 8) float32, aligned to
    32 bytes, which may lie apart; index (m,) int32."""

    def codegen(context, builder, sig, args):
        index = _indices(context, builder, sig.args[1], args[1], args[2])
        places = [_row(context, builder, sig.args[0], args[0], k, ROW_F32.vector) for k in index]
        return context.make_tuple(builder, sig.return_type, _columns(builder, places))

    return types.UniTuple(F32, 8)(rows, index, start), codegen


def _pair_rows(builder, double, i, j, combine):
    """Return what `combine` makes of the position rows of the pairs i, j, four float64 each, as
    vectors of `WIDTH`, eight pairs at a time in groups of four: one for each of the four
    numbers."""
    four, made = ir.VectorType(ir.DoubleType(), 4), []
    for a, b in zip(i, j, strict=True):
        ra = _load(builder, double, builder.mul(a, _constant(8)), four, 32)
        rb = _load(builder, double, builder.mul(b, _constant(8)), four, 32)
        made.append(combine(ra, rb))
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


@intrinsic
def gather_separations(typingctx, rows, first, second, start):
    """(dx, dy, dz) as `gather_pairs` has it, and the sum of the radii, F64; far less than all that
    a contact needs."""

    def codegen(context, builder, sig, args):
        double = _pointer(context, builder, sig.args[0], args[0], ir.DoubleType())
        i = _indices(context, builder, sig.args[1], args[1], args[3])
        j = _indices(context, builder, sig.args[2], args[2], args[3])

        def difference_and_sum(a, b):
            return _shuffle(builder, builder.fsub(a, b), builder.fadd(a, b), [0, 1, 2, 7])

        values = _pair_rows(builder, double, i, j, difference_and_sum)
        return context.make_tuple(builder, sig.return_type, values)

    return types.UniTuple(F64, 4)(rows, first, second, start), codegen


@intrinsic
def gather_pairs(typingctx, rows, first, second, start):
    """Load `WIDTH` pairs of particle rows.

    Parameters: rows (n, 8) float64 buffer of 64-byte rows; first, second (m,) int32; start: first
    pair.
    Returns (dx, dy, dz) = position of first minus position of second, F64, then the eight F32
    columns of the first particle and the eight of the second.
    """
    out = types.Tuple([F64] * 3 + [F32] * 16)

    def codegen(context, builder, sig, args):
        double = _pointer(context, builder, sig.args[0], args[0], ir.DoubleType())
        single = builder.bitcast(double, ir.FloatType().as_pointer())
        i = _indices(context, builder, sig.args[1], args[1], args[3])
        j = _indices(context, builder, sig.args[2], args[2], args[3])
        values = _pair_rows(builder, double, i, j, builder.fsub)[:3]
        for index in (i, j):
            places = [builder.add(builder.mul(k, _constant(16)), _constant(8)) for k in index]
            values += _columns(builder, [builder.gep(single, [k]) for k in places])
        return context.make_tuple(builder, sig.return_type, values)

    return out(rows, first, second, start), codegen


@intrinsic
def scatter_add(typingctx, target, index, start, columns):
    """Add eight lane columns to rows `index[start:start+WIDTH]` of target (n, 8) float32, one lane
    after the other.

    Lanes are added in order, so a particle that stands in several lanes receives every share.
    """

    def codegen(context, builder, sig, args):
        base = _pointer(context, builder, sig.args[0], args[0], ir.FloatType())
        index = _indices(context, builder, sig.args[1], args[1], args[2])
        columns = [builder.extract_value(args[3], k) for k in range(8)]
        eight, groups = ir.VectorType(ir.FloatType(), 8), _transpose(builder, columns)
        rows = [
            _shuffle(builder, group, group, list(range(start, start + 8)))
            for start in range(0, WIDTH, 8)
            for group in groups
        ]
        for k, row in zip(index, rows, strict=True):
            pointer = builder.bitcast(
                builder.gep(base, [builder.mul(k, _constant(8))]), eight.as_pointer()
            )
            old = builder.load(pointer)
            old.align = 32
            builder.store(builder.fadd(old, row), pointer).align = 32
        return context.get_dummy_value()

    return types.none(target, index, start, columns), codegen


def _field(context, builder, array_type, array, block, k):
    """Pointer to field k of block `block` of blocks (m, FIELDS, WIDTH) float32."""
    base = _pointer(context, builder, array_type, array, ir.FloatType())
    place = builder.add(builder.mul(block, _constant(FIELDS * WIDTH)), _constant(WIDTH * k))
    return builder.bitcast(builder.gep(base, [place]), F32.vector.as_pointer())


@intrinsic
def load_field(typingctx, blocks, block, field):
    """Field `field`, a literal, of block `block` of blocks (m, FIELDS, WIDTH) float32, as F32."""
    if not isinstance(field, types.IntegerLiteral):
        raise RequireLiteralValue("field")
    number = field.literal_value

    def codegen(context, builder, sig, args):
        load = builder.load(_field(context, builder, sig.args[0], *args[:2], number))
        load.align = 4 * WIDTH
        return load

    return F32(blocks, block, field), codegen


@intrinsic
def store_field(typingctx, blocks, block, field, value):
    """Store an F32 as field `field`, a literal, of block `block` of blocks (m, FIELDS, WIDTH)
    float32."""
    if not isinstance(field, types.IntegerLiteral):
        raise RequireLiteralValue("field")
    number = field.literal_value

    def codegen(context, builder, sig, args):
        pointer = _field(context, builder, sig.args[0], *args[:2], number)
        builder.store(args[3], pointer).align = 4 * WIDTH
        return context.get_dummy_value()

    return types.none(blocks, block, field, value), codegen


@intrinsic
def load_block(typingctx, blocks, block):
    """All fields of block `block` of blocks (m, FIELDS, WIDTH) float32 as FIELDS F32."""

    def codegen(context, builder, sig, args):
        values = []
        for k in range(FIELDS):
            load = builder.load(_field(context, builder, sig.args[0], *args, k))
            load.align = 4 * WIDTH
            values.append(load)
        return context.make_tuple(builder, sig.return_type, values)

    return types.UniTuple(F32, FIELDS)(blocks, block), codegen


@intrinsic
def store_block(typingctx, blocks, block, fields):
    """Store the F32 of a tuple into the first fields of block `block` of blocks (m, FIELDS, WIDTH)
    float32."""

    def codegen(context, builder, sig, args):
        for k in range(len(sig.args[2])):
            pointer = _field(context, builder, sig.args[0], *args[:2], k)
            builder.store(builder.extract_value(args[2], k), pointer).align = 4 * WIDTH
        return context.get_dummy_value()

    return types.none(blocks, block, fields), codegen


@intrinsic
def load_lanes(typingctx, values, start):
    """values[start : start + WIDTH] of a (m,) float32 as F32."""

    def codegen(context, builder, sig, args):
        base = _pointer(context, builder, sig.args[0], args[0], ir.FloatType())
        return _load(builder, base, args[1], F32.vector, 4)

    return F32(values, start), codegen


@intrinsic
def bits_of(typingctx, mask):
    """A mask as an int64: bit k is lane k."""

    def codegen(context, builder, sig, args):
        bits = builder.bitcast(args[0], ir.IntType(WIDTH))
        return builder.zext(bits, ir.IntType(64))

    return types.int64(mask), codegen


@intrinsic
def lowest_bit(typingctx, bits):
    """Number of the lowest bit that is set; bits must not be 0."""

    def codegen(context, builder, sig, args):
        return builder.cttz(args[0], ir.Constant(ir.IntType(1), 1))

    return types.int64(types.int64), codegen


inlined = njit(forceinline=True, error_model="numpy")
"""Decorator of a kernel's part that takes named tuples of arrays: a real call would copy kilobytes
of pointers."""


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


@intrinsic
def load_row(typingctx, rows, index):
    """Row `index` of rows (n, 8) float32, aligned to 32 bytes, as ROW_F32."""

    def codegen(context, builder, sig, args):
        load = builder.load(_row(context, builder, sig.args[0], *args, ROW_F32.vector))
        load.align = 4 * ROW
        return load

    return ROW_F32(rows, index), codegen


@intrinsic
def store_row(typingctx, rows, index, values):
    """Store a ROW_F32 as row `index` of rows (n, 8) float32, aligned to 32 bytes."""

    def codegen(context, builder, sig, args):
        pointer = _row(context, builder, sig.args[0], *args[:2], ROW_F32.vector)
        builder.store(args[2], pointer).align = 4 * ROW
        return context.get_dummy_value()

    return types.none(rows, index, values), codegen


@intrinsic
def spread(typingctx, linear, angular):
    """ROW_F32 with `linear` in lanes 0-2, `angular` in 3-5 and 0 in 6 and 7; both float32."""

    def codegen(context, builder, sig, args):
        one, other = (broadcast(builder, a, ROW_F32) for a in args)
        both = _shuffle(builder, one, other, [0, 1, 2, 11, 12, 13, 6, 7])
        zero = ir.Constant(both.type, [0.0] * ROW)
        return _shuffle(builder, both, zero, [0, 1, 2, 3, 4, 5, 14, 15])

    return ROW_F32(linear, angular), codegen


@intrinsic
def linear_lanes(typingctx, x, y, z):
    """ROW_F32 with three float32 in lanes 0-2 and 0 beyond."""

    def codegen(context, builder, sig, args):
        out = ir.Constant(ROW_F32.vector, [0.0] * ROW)
        for k, value in enumerate(args):
            out = builder.insert_element(out, value, ir.Constant(ir.IntType(32), k))
        return out

    return ROW_F32(x, y, z), codegen


def _sum_of_squares(builder, values, lanes):
    total = None
    for k in lanes:
        value = builder.extract_element(values, ir.Constant(ir.IntType(32), k))
        square = builder.fmul(value, value, flags=_CONTRACT)
        total = builder.fadd(total, square, flags=_CONTRACT) if total else square
    return total


@intrinsic
def angular_square(typingctx, values):
    """Sum of the squares of lanes 3-5 of a ROW_F32, a float32."""

    def codegen(context, builder, sig, args):
        return _sum_of_squares(builder, args[0], (3, 4, 5))

    return types.float32(values), codegen


@intrinsic
def move_row(typingctx, position, drift, index, step):
    """Add lanes 0-2 of the ROW_F32 `step`, whose lane 3 is 0, to a row of position (n, 4) float64
    and of drift (n, 4) float32; True when the drift's square exceeds its fourth number."""

    def codegen(context, builder, sig, args):
        four = _shuffle(builder, args[3], args[3], [0, 1, 2, 3])
        wide, narrow_ = (ir.VectorType(t, 4) for t in (ir.DoubleType(), ir.FloatType()))
        where_ = _row(context, builder, sig.args[0], args[0], args[2], wide)
        place = builder.load(where_)
        place.align = 32
        moved = builder.fadd(place, builder.fpext(four, wide))
        builder.store(moved, where_).align = 32
        where_ = _row(context, builder, sig.args[1], args[1], args[2], narrow_)
        before = builder.load(where_)
        before.align = 16
        after = builder.fadd(before, four)
        builder.store(after, where_).align = 16
        limit = builder.extract_element(after, ir.Constant(ir.IntType(32), 3))
        return builder.fcmp_ordered(">", _sum_of_squares(builder, after, (0, 1, 2)), limit)

    return types.boolean(position, drift, index, step), codegen
