"""The machine instructions of `lanes`: SIMD arithmetic on eight numbers at once."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir

from escort_mj.native import lanes as names
from escort_mj.native.compiler.machine import instructions_of
from escort_mj.native.compiler.numba_parts import (
    ConcreteTemplate,
    cgutils,
    infer_global,
    lower_builtin,
    make_array,
    models,
    overload,
    populate_array,
    register_model,
    signature,
    types,
)
from escort_mj.native.kernels import DOUBLE
from escort_mj.native.lanes import STACK_ROWS, WIDTH


class _LanesType(types.Type):
    def __init__(self) -> None:
        super().__init__(name="Lanes")


class _MaskType(types.Type):
    def __init__(self) -> None:
        super().__init__(name="LanesMask")


lanes, mask = _LanesType(), _MaskType()
LANES = ir.VectorType(ir.DoubleType(), WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)
_INT = ir.IntType(32)
_CONTRACT = ("contract",)  # as kernels.OPTIONS has it for floats


@register_model(_LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: types.Type) -> None:
        super().__init__(manager, kind, LANES)


@register_model(_MaskType)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: types.Type) -> None:
        super().__init__(manager, kind, _BITS)


def spread(builder: Any, value: Any, kind: Any) -> Any:
    """A value in all lanes of a kind, unless it is lanes already."""
    if value.type == kind:
        return value
    nothing = ir.Constant(kind, ir.Undefined)
    single = builder.insert_element(nothing, value, _INT(0))
    return builder.shuffle_vector(single, nothing, ir.Constant(ir.VectorType(_INT, WIDTH), [0] * WIDTH))


def teach_operator(
    function: Any, result: types.Type, of: types.Type, single: types.Type, kind: Any, generate: Any
) -> None:
    """Teaches kernels what an operator makes of two lanes, or of lanes and a single number.

    Args:
        function: The operator.
        result: Type in kernels of what comes of it.
        of: Type in kernels of the lanes.
        single: Type in kernels of one number.
        kind: The lanes as LLVM has them.
        generate: Called with the builder and both values, in lanes.
    """
    pairs = ((of, of), (of, single), (single, of))

    @infer_global(function)
    class Template(ConcreteTemplate):
        cases = [signature(result, *pair) for pair in pairs]

    for pair in pairs:

        @lower_builtin(function, *pair)
        def lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
            return generate(builder, *(spread(builder, value, kind) for value in arguments))


def teach_function(function: Any, count: int, written: Callable[..., Any]) -> None:
    """Teaches kernels what a function is of lanes.

    Args:
        function: Of Python or NumPy; of other arguments it stays what it is.
        count: How many arguments it takes.
        written: The same in kernels.
    """

    def chosen(arguments: tuple[types.Type, ...]) -> Any:
        return written if lanes in arguments or mask in arguments else None

    forms = (lambda x: chosen((x,)), lambda x, y: chosen((x, y)), lambda x, y, z: chosen((x, y, z)))
    overload(function, strict=False)(forms[count - 1])


def _wide(builder: Any, value: Any) -> Any:
    return spread(builder, value, LANES)


def _binary(function: Any, result: types.Type, generate: Callable[[Any, Any, Any], Any]) -> None:
    teach_operator(function, result, lanes, types.float64, LANES, generate)


def add(builder: Any, x: Any, y: Any) -> Any:
    """Sum of two lanes."""
    return builder.fadd(x, y, flags=_CONTRACT)


def subtract(builder: Any, x: Any, y: Any) -> Any:
    """Difference of two lanes."""
    return builder.fsub(x, y, flags=_CONTRACT)


def multiply(builder: Any, x: Any, y: Any) -> Any:
    """Product of two lanes."""
    return builder.fmul(x, y, flags=_CONTRACT)


_binary(operator.add, lanes, add)
_binary(operator.sub, lanes, subtract)
_binary(operator.mul, lanes, multiply)
_binary(operator.truediv, lanes, lambda b, x, y: b.fdiv(x, y))
_binary(operator.lt, mask, lambda b, x, y: b.fcmp_ordered("<", x, y))
_binary(operator.gt, mask, lambda b, x, y: b.fcmp_ordered(">", x, y))
_binary(operator.le, mask, lambda b, x, y: b.fcmp_ordered("<=", x, y))
_binary(operator.ge, mask, lambda b, x, y: b.fcmp_ordered(">=", x, y))
_binary(operator.ne, mask, lambda b, x, y: b.fcmp_unordered("!=", x, y))


def _same_kind(function: Any, kind: types.Type, count: int, generate: Callable[..., Any]) -> None:
    """Teaches kernels an operator whose arguments and result are of one kind."""

    @infer_global(function)
    class Template(ConcreteTemplate):
        cases = [signature(kind, *[kind] * count)]

    @lower_builtin(function, *[kind] * count)
    def lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return generate(builder, *arguments)


_same_kind(operator.and_, mask, 2, lambda b, x, y: b.and_(x, y))
_same_kind(operator.or_, mask, 2, lambda b, x, y: b.or_(x, y))
_same_kind(operator.invert, mask, 1, lambda b, x: b.not_(x))
_same_kind(operator.neg, lanes, 1, lambda b, x: b.fneg(x))


def _called(name: str) -> Callable[[Any, Any, Any, Any], Any]:
    """Lowers to LLVM's own function of lanes."""

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(LANES, [LANES] * len(arguments))
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64")
        return builder.call(function, [_wide(builder, value) for value in arguments])

    return generate


def multiply_add(builder: Any, x: Any, y: Any, z: Any) -> Any:
    """X y + z of lanes or of numbers, rounded once where the processor can."""
    kind, of = ir.FunctionType(x.type, [x.type] * 3), f"v{WIDTH}f64" if x.type == LANES else "f64"
    function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.fmuladd.{of}")
    return builder.call(function, [x, y, z])


@infer_global(abs)
class _Size(ConcreteTemplate):
    cases = [signature(lanes, lanes)]


lower_builtin(abs, lanes)(_called("fabs"))


@instructions_of(names.root)
def _root(context: Any, x: Any) -> Any:
    if x == lanes:
        return lanes(lanes), _called("sqrt")

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(ir.DoubleType(), [ir.DoubleType()])
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, "llvm.sqrt.f64"), arguments)

    return types.float64(types.float64), generate


@instructions_of(names.copysign)
def _copysign(context: Any, size: Any, sign: Any) -> Any:
    return lanes(size, sign), _called("copysign")


@instructions_of(names.where)
def _where(context: Any, condition: Any, yes: Any, no: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return builder.select(arguments[0], *(_wide(builder, value) for value in arguments[1:]))

    return lanes(condition, yes, no), generate


def _choose(function: Any, comparison: str) -> None:
    """The one of two that compares so with the other; the second where one is no number."""

    @instructions_of(function)
    def choose(context: Any, x: Any, y: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
            a, b = (_wide(builder, value) for value in arguments)
            return builder.select(builder.fcmp_ordered(comparison, a, b), a, b)

        return lanes(x, y), generate


_choose(names.least, "<")
_choose(names.greatest, ">")


@instructions_of(names.any_of)
def _any_of(context: Any, condition: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        bits = builder.bitcast(arguments[0], ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", bits, ir.IntType(WIDTH)(0))

    return types.boolean(condition), generate


@instructions_of(names.total)
def _total(context: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        numbers = [builder.extract_element(arguments[0], _INT(lane)) for lane in range(WIDTH)]
        while len(numbers) > 1:
            numbers = [builder.fadd(*pair) for pair in zip(numbers[::2], numbers[1::2], strict=True)]
        return numbers[0]

    return types.float64(x), generate


@instructions_of(names.largest)
def _largest(context: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        found = builder.extract_element(arguments[0], _INT(0))
        for lane in range(1, WIDTH):
            number = builder.extract_element(arguments[0], _INT(lane))
            found = builder.select(builder.fcmp_ordered(">", found, number), found, number)
        return found

    return types.float64(x), generate


@instructions_of(names.everywhere)
def _everywhere(context: Any, x: Any) -> Any:
    return lanes(x), lambda context, builder, sig, arguments: _wide(builder, arguments[0])


@instructions_of(names.load)
def _load(context: Any, array: Any, at: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        at = context.cast(builder, arguments[1], sig.args[1], types.intp)
        return load_at(builder, context.make_array(sig.args[0])(context, builder, arguments[0]).data, at)

    return lanes(array, at), generate


def load_at(builder: Any, data: Any, at: Any) -> Any:
    """Lanes in a row from a place on."""
    return builder.load(builder.bitcast(builder.gep(data, [at]), LANES.as_pointer()), align=DOUBLE)


@instructions_of(names.gather)
def _gather(context: Any, array: Any, at: Any, stride: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        at, stride = (
            context.cast(builder, value, kind, types.intp)
            for value, kind in zip(arguments[1:], sig.args[1:], strict=True)
        )
        data = context.make_array(sig.args[0])(context, builder, arguments[0]).data
        return gather_at(builder, data, at, stride)

    return lanes(array, at, stride), generate


def gather_at(builder: Any, data: Any, at: Any, stride: Any) -> Any:
    """Lanes from a place on, so far apart."""
    found = ir.Constant(LANES, ir.Undefined)
    for lane in range(WIDTH):
        found = builder.insert_element(found, builder.load(builder.gep(data, [at])), _INT(lane))
        at = builder.add(at, stride)
    return found


@instructions_of(names.pick)
def _pick(context: Any, array: Any, places: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        data = context.make_array(sig.args[0])(context, builder, arguments[0]).data
        return pick_at(builder, data, arguments[1])

    return lanes(array, places), generate


def pick_at(builder: Any, data: Any, places: Any) -> Any:
    """Lanes from anywhere: places are whole floats."""
    found = ir.Constant(LANES, ir.Undefined)
    whole = builder.fptosi(places, ir.VectorType(ir.IntType(64), WIDTH))
    for lane in range(WIDTH):
        number = builder.load(builder.gep(data, [builder.extract_element(whole, _INT(lane))]))
        found = builder.insert_element(found, number, _INT(lane))
    return found


@instructions_of(names.lane_numbers)
def _lane_numbers(context: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        return ir.Constant(LANES, [float(lane) for lane in range(WIDTH)])

    return lanes(), generate


def _whole(builder: Any, data: Any, at: Any, count: int) -> list[Any]:
    """Pointers to so many lanes in a row, from a place on."""
    places = [builder.add(at, at.type(WIDTH * k)) for k in range(count)]
    return [builder.bitcast(builder.gep(data, [place]), LANES.as_pointer()) for place in places]


def store_at(builder: Any, data: Any, at: Any, x: Any) -> None:
    """Store lanes in a row from a place on."""
    (pointer,) = _whole(builder, data, at, 1)
    builder.store(x, pointer, align=DOUBLE)


def _place(context: Any, builder: Any, sig: Any, arguments: Any) -> tuple[Any, Any]:
    """Where an array's numbers are, and a place in them: the first two arguments."""
    data = context.make_array(sig.args[0])(context, builder, arguments[0]).data
    return data, context.cast(builder, arguments[1], sig.args[1], types.intp)


@instructions_of(names.store)
def _store(context: Any, array: Any, at: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        store_at(builder, *_place(context, builder, sig, arguments), _wide(builder, arguments[2]))
        return context.get_dummy_value()

    return types.void(array, at, x), generate


@instructions_of(names.scatter)
def _scatter(context: Any, array: Any, at: Any, stride: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        place, stride = (
            context.cast(builder, value, kind, types.intp)
            for value, kind in zip(arguments[1:3], sig.args[1:3], strict=True)
        )
        data = context.make_array(sig.args[0])(context, builder, arguments[0]).data
        scatter_at(builder, data, place, stride, _wide(builder, arguments[3]))
        return context.get_dummy_value()

    return types.void(array, at, stride, x), generate


def scatter_at(builder: Any, data: Any, at: Any, stride: Any, x: Any) -> None:
    """Store lanes from a place on, so far apart."""
    for lane in range(WIDTH):
        builder.store(builder.extract_element(x, _INT(lane)), builder.gep(data, [at]))
        at = builder.add(at, stride)


def _chosen(builder: Any, rows: Sequence[Any], places: Sequence[tuple[int, int]]) -> Any:
    """Lanes put together of others: of each lane the row that has it, and where."""
    found, taken = rows[0], [lane if row == 0 else 0 for row, lane in places]
    for number, row in enumerate(rows[1:], 1):
        mask = [
            WIDTH + lane if of == number else (taken[k] if number == 1 else k)
            for k, (of, lane) in enumerate(places)
        ]
        found = builder.shuffle_vector(found, row, ir.Constant(ir.VectorType(_INT, WIDTH), mask))
    return found


def read_woven(builder: Any, data: Any, at: Any, count: int) -> list[Any]:
    """Lanes of each number of eight tuples of so many numbers, in a row from a place on."""
    rows = [builder.load(pointer, align=DOUBLE) for pointer in _whole(builder, data, at, count)]
    return [
        _chosen(builder, rows, [divmod(lane * count + k, WIDTH) for lane in range(WIDTH)])
        for k in range(count)
    ]


def write_woven(builder: Any, data: Any, at: Any, columns: Sequence[Any]) -> None:
    """Store lanes of each number of eight tuples, in a row from a place on."""
    count = len(columns)
    for number, pointer in enumerate(_whole(builder, data, at, count)):
        places = [divmod(number * WIDTH + lane, count)[::-1] for lane in range(WIDTH)]
        builder.store(_chosen(builder, columns, places), pointer, align=DOUBLE)


def _reading_woven(count: int) -> Callable[..., Any]:
    kinds = types.UniTuple(lanes, count)

    def read(context: Any, array: Any, at: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
            found = read_woven(builder, *_place(context, builder, sig, arguments), count)
            return context.make_tuple(builder, kinds, found)

        return kinds(array, at), generate

    return read


instructions_of(names.load_pairs)(_reading_woven(2))
instructions_of(names.load_triples)(_reading_woven(3))


@instructions_of(names.two_to)
def _two_to(context: Any, shifted: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        integers = ir.VectorType(ir.IntType(64), WIDTH)
        bits = builder.bitcast(arguments[0], integers)
        exponent = builder.add(bits, ir.Constant(integers, [1023] * WIDTH))
        exponent = builder.shl(exponent, ir.Constant(integers, [52] * WIDTH))
        return builder.bitcast(exponent, LANES)

    return lanes(shifted), generate


@instructions_of(names.stack_rows)
def _stack_rows(context: Any, rows: Any) -> Any:
    kind = types.Array(types.float64, 2, "C")

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        rows = context.cast(builder, arguments[0], sig.args[0], types.intp)
        width, item = rows.type(WIDTH), rows.type(DOUBLE)
        with builder.goto_entry_block():
            data = builder.alloca(ir.DoubleType(), size=rows.type(STACK_ROWS * WIDTH))
            data.align = DOUBLE * WIDTH  # rows that lie across two lines of the cache cost twice
        array = make_array(kind)(context, builder)
        strides = [rows.type(DOUBLE * WIDTH), item]
        populate_array(array, data=data, shape=[rows, width], strides=strides, itemsize=item, meminfo=None)
        return array._getvalue()

    return kind(rows), generate
