"""Four numbers at once: a type for kernels whose arithmetic is the machine's SIMD arithmetic.

`load` takes four neighbors of a vector, `gather` one number of each of four rows; with these, kernels compute
as with floats, `where` in place of `if`, and `store` puts back as many as there are. The compiler's own
vectorizer needs to know that the arrays of a loop do not overlap, which nobody can tell it of views of one
memory; and short loops, those of a few robots, it leaves alone.

Numbers are read up to three past the end of an array: inside the state, whatever follows there.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model
from numba.np.arrayobj import make_array, populate_array
from numpy.typing import NDArray

from escort_mj.kernels import DOUBLE, inlined

WIDTH = 4


class Lanes:
    """The type as annotations name it."""

    __add__: Callable[[Lanes, Lanes | float], Lanes]
    __radd__: Callable[[Lanes, float], Lanes]
    __sub__: Callable[[Lanes, Lanes | float], Lanes]
    __rsub__: Callable[[Lanes, float], Lanes]
    __mul__: Callable[[Lanes, Lanes | float], Lanes]
    __rmul__: Callable[[Lanes, float], Lanes]
    __truediv__: Callable[[Lanes, Lanes | float], Lanes]
    __rtruediv__: Callable[[Lanes, float], Lanes]
    __neg__: Callable[[Lanes], Lanes]
    __abs__: Callable[[], Lanes]
    __float__: Callable[[], float]  # for math.sqrt
    __lt__: Callable[[Lanes, Lanes | float], Any]
    __gt__: Callable[[Lanes, Lanes | float], Any]
    __and__: Callable[[Lanes, Any], Any]


class _LanesType(types.Type):
    def __init__(self) -> None:
        super().__init__(name="Lanes")


class _MaskType(types.Type):
    def __init__(self) -> None:
        super().__init__(name="LanesMask")


lanes, mask = _LanesType(), _MaskType()
_DOUBLES = ir.VectorType(ir.DoubleType(), WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)
_INT = ir.IntType(32)
_CONTRACT = ("contract",)  # as kernels.OPTIONS has it for floats


@register_model(_LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: types.Type) -> None:
        super().__init__(manager, kind, _DOUBLES)


@register_model(_MaskType)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: types.Type) -> None:
        super().__init__(manager, kind, _BITS)


def _wide(builder: Any, value: Any) -> Any:
    """A value in all lanes, unless it is lanes already."""
    if value.type == _DOUBLES:
        return value
    single = builder.insert_element(ir.Constant(_DOUBLES, ir.Undefined), value, _INT(0))
    return builder.shuffle_vector(
        single, ir.Constant(_DOUBLES, ir.Undefined), ir.Constant(ir.VectorType(_INT, WIDTH), [0] * WIDTH)
    )


_PAIRS = ((lanes, lanes), (lanes, types.float64), (types.float64, lanes))


def _binary(function: Any, result: types.Type, generate: Callable[[Any, Any, Any], Any]) -> None:
    """Teaches kernels what an operator makes of two lanes, or of lanes and a float."""

    @infer_global(function)
    class Template(ConcreteTemplate):
        cases = [signature(result, *pair) for pair in _PAIRS]

    for pair in _PAIRS:

        @lower_builtin(function, *pair)
        def lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
            return generate(builder, _wide(builder, arguments[0]), _wide(builder, arguments[1]))


_binary(operator.add, lanes, lambda b, x, y: b.fadd(x, y, flags=_CONTRACT))
_binary(operator.sub, lanes, lambda b, x, y: b.fsub(x, y, flags=_CONTRACT))
_binary(operator.mul, lanes, lambda b, x, y: b.fmul(x, y, flags=_CONTRACT))
_binary(operator.truediv, lanes, lambda b, x, y: b.fdiv(x, y))
_binary(operator.lt, mask, lambda b, x, y: b.fcmp_ordered("<", x, y))
_binary(operator.gt, mask, lambda b, x, y: b.fcmp_ordered(">", x, y))
_binary(operator.ne, mask, lambda b, x, y: b.fcmp_unordered("!=", x, y))


@infer_global(operator.and_)
class _And(ConcreteTemplate):
    cases = [signature(mask, mask, mask)]


@lower_builtin(operator.and_, mask, mask)
def _and(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    return builder.and_(*arguments)


@infer_global(operator.neg)
class _Negative(ConcreteTemplate):
    cases = [signature(lanes, lanes)]


@lower_builtin(operator.neg, lanes)
def _negative(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    return builder.fneg(arguments[0])


def _called(name: str) -> Callable[[Any, Any, Any, Any], Any]:
    """Lowers to LLVM's own function of four doubles."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(_DOUBLES, [_DOUBLES] * len(arguments))
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64")
        return builder.call(function, [_wide(builder, value) for value in arguments])

    return generate


@infer_global(abs)
@infer_global(math.sqrt)
class _Unary(ConcreteTemplate):
    cases = [signature(lanes, lanes)]


lower_builtin(abs, lanes)(_called("fabs"))
lower_builtin(math.sqrt, lanes)(_called("sqrt"))


@intrinsic
def copysign(context: Any, size: Any, sign: Any) -> Any:
    """The magnitude of one with the sign of the other."""
    return lanes(size, sign), _called("copysign")


@intrinsic
def where(context: Any, condition: Any, yes: Any, no: Any) -> Any:
    """Lane by lane: one thing where a condition holds, else the other."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return builder.select(arguments[0], *(_wide(builder, value) for value in arguments[1:]))

    return lanes(condition, yes, no), generate


def _chosen(comparison: str) -> Any:
    """The one of two that compares so with the other; the second where one is no number."""

    @intrinsic
    def choose(context: Any, x: Any, y: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
            a, b = (_wide(builder, value) for value in arguments)
            return builder.select(builder.fcmp_ordered(comparison, a, b), a, b)

        return lanes(x, y), generate

    return choose


least, greatest = _chosen("<"), _chosen(">")


@intrinsic
def any_of(context: Any, condition: Any) -> Any:
    """Whether a condition holds in some lane."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        bits = builder.bitcast(arguments[0], ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", bits, ir.IntType(WIDTH)(0))

    return types.boolean(condition), generate


@intrinsic
def total(context: Any, x: Any) -> Any:
    """Sum over the lanes."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        numbers = [builder.extract_element(arguments[0], _INT(lane)) for lane in range(WIDTH)]
        return builder.fadd(builder.fadd(*numbers[:2]), builder.fadd(*numbers[2:]))

    return types.float64(x), generate


@intrinsic
def everywhere(context: Any, x: Any) -> Any:
    """The same float in all lanes."""
    return lanes(x), lambda context, builder, sig, arguments: _wide(builder, arguments[0])


def _address(context: Any, builder: Any, kind: types.Array, array: Any, at: Any) -> Any:
    """Pointer to a number of an array of any shape, counted as in a flat one."""
    data = context.make_array(kind)(context, builder, array).data
    return builder.gep(data, [at])


@intrinsic
def load(context: Any, array: Any, at: Any) -> Any:
    """Four numbers in a row of an array, as if it were flat."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        at = context.cast(builder, arguments[1], sig.args[1], types.intp)
        pointer = _address(context, builder, sig.args[0], arguments[0], at)
        return builder.load(builder.bitcast(pointer, _DOUBLES.as_pointer()), align=DOUBLE)

    return lanes(array, at), generate


@intrinsic
def gather(context: Any, array: Any, at: Any, stride: Any) -> Any:
    """Four numbers of an array, as if it were flat, so far apart."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        at, stride = (
            context.cast(builder, value, kind, types.intp)
            for value, kind in zip(arguments[1:], sig.args[1:], strict=True)
        )
        found = ir.Constant(_DOUBLES, ir.Undefined)
        for lane in range(WIDTH):
            number = builder.load(_address(context, builder, sig.args[0], arguments[0], at))
            found = builder.insert_element(found, number, _INT(lane))
            at = builder.add(at, stride)
        return found

    return lanes(array, at, stride), generate


@intrinsic
def pick(context: Any, array: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Four numbers of an array, as if it were flat, from anywhere."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        found = ir.Constant(_DOUBLES, ir.Undefined)
        for lane in range(WIDTH):
            at = context.cast(builder, arguments[1 + lane], sig.args[1 + lane], types.intp)
            number = builder.load(_address(context, builder, sig.args[0], arguments[0], at))
            found = builder.insert_element(found, number, _INT(lane))
        return found

    return lanes(array, a, b, c, d), generate


@intrinsic
def lane_numbers(context: Any) -> Any:
    """The numbers of the lanes, from 0."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return ir.Constant(_DOUBLES, [float(lane) for lane in range(WIDTH)])

    return lanes(), generate


@intrinsic
def store(context: Any, array: Any, at: Any, left: Any, x: Any) -> Any:
    """Writes lanes to an array, as if it were flat: all four, or so many as are left."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        at, left = (
            context.cast(builder, value, kind, types.intp)
            for value, kind in zip(arguments[1:3], sig.args[1:3], strict=True)
        )
        wide = _wide(builder, arguments[3])
        word = left.type
        with builder.if_else(builder.icmp_signed(">=", left, word(WIDTH))) as (whole, part):
            with whole:
                pointer = _address(context, builder, sig.args[0], arguments[0], at)
                builder.store(wide, builder.bitcast(pointer, _DOUBLES.as_pointer()), align=DOUBLE)
            with part:
                for lane in range(WIDTH - 1):
                    with builder.if_then(builder.icmp_signed(">", left, word(lane))):
                        number = builder.extract_element(wide, _INT(lane))
                        place = builder.add(at, word(lane))
                        builder.store(number, _address(context, builder, sig.args[0], arguments[0], place))
        return context.get_dummy_value()

    return types.void(array, at, left, x), generate


@intrinsic
def scatter(context: Any, array: Any, at: Any, stride: Any, left: Any, x: Any) -> Any:
    """Writes lanes to an array so far apart: all four, or so many as are left."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        at, stride, left = (
            context.cast(builder, value, kind, types.intp)
            for value, kind in zip(arguments[1:4], sig.args[1:4], strict=True)
        )

        def write(lane: int) -> None:
            number = builder.extract_element(arguments[4], _INT(lane))
            place = builder.add(at, builder.mul(stride, stride.type(lane)))
            builder.store(number, _address(context, builder, sig.args[0], arguments[0], place))

        with builder.if_else(builder.icmp_signed(">=", left, left.type(WIDTH))) as (whole, part):
            with whole:
                for lane in range(WIDTH):
                    write(lane)
            with part:
                for lane in range(WIDTH - 1):
                    with builder.if_then(builder.icmp_signed(">", left, left.type(lane))):
                        write(lane)
        return context.get_dummy_value()

    return types.void(array, at, stride, left, x), generate


@intrinsic
def two_to(context: Any, shifted: Any) -> Any:
    """2**n for n + 1.5 * 2**52: that sum leaves n in the lowest bits, from where it moves to the exponent."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        integers = ir.VectorType(ir.IntType(64), WIDTH)
        bits = builder.bitcast(arguments[0], integers)
        exponent = builder.add(bits, ir.Constant(integers, [1023] * WIDTH))
        exponent = builder.shl(exponent, ir.Constant(integers, [52] * WIDTH))
        return builder.bitcast(exponent, _DOUBLES)

    return lanes(shifted), generate


STACK_ROWS = 24


@intrinsic
def stack_rows(context: Any, rows: Any) -> Any:
    """Scratch of so many rows of four numbers, STACK_ROWS at most; nothing is in it yet.

    Each place that asks has memory of its own, whose address nobody else knows: the compiler keeps in
    registers what is read and written at places that it knows.
    """
    kind = types.Array(types.float64, 2, "C")

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        rows = context.cast(builder, arguments[0], sig.args[0], types.intp)
        width, item = rows.type(WIDTH), rows.type(DOUBLE)
        with builder.goto_entry_block():
            data = builder.alloca(ir.DoubleType(), size=rows.type(STACK_ROWS * WIDTH))
        array = make_array(kind)(context, builder)
        strides = [rows.type(DOUBLE * WIDTH), item]
        populate_array(array, data=data, shape=[rows, width], strides=strides, itemsize=item, meminfo=None)
        return array._getvalue()

    return kind(rows), generate


@inlined
def row_of(rows: NDArray[np.float64], k: int) -> Lanes:
    """A row of scratch."""
    return load(rows, WIDTH * k)


@inlined
def set_row(rows: NDArray[np.float64], k: int, x: Lanes) -> None:
    """Writes a row of scratch."""
    store(rows, WIDTH * k, WIDTH, x)


@inlined
def four_from(at: int, count: int) -> int:
    """Where four of so many numbers begin: `at`, or earlier so that all four are there, if so many are.

    What is found for some twice is the same twice, as long as nothing is added up.
    """
    return max(min(at, count - WIDTH), 0)


@inlined
def copy_numbers(source: NDArray[np.float64], target: NDArray[np.float64], count: int) -> None:
    """Copies so many numbers from the beginning of one array to that of another, as if both were flat."""
    for begin in range(0, count, WIDTH):
        at = four_from(begin, count)
        store(target, at, count - at, load(source, at))
