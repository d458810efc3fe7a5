"""The machine instructions of `vectors`: p lanes as one value."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable
from typing import Any

from llvmlite import ir

from escort_mj.native import vectors as names
from escort_mj.native.compiler.lanes import (
    LANES,
    add,
    gather_at,
    lanes,
    load_at,
    multiply,
    multiply_add,
    pick_at,
    read_woven,
    scatter_at,
    spread,
    store_at,
    subtract,
    write_woven,
)
from escort_mj.native.compiler.machine import instructions_of
from escort_mj.native.compiler.numba_parts import (
    AbstractTemplate,
    TypingError,
    infer,
    infer_global,
    lower_builtin,
    make_array,
    models,
    register_model,
    signature,
    types,
)
from escort_mj.native.compiler.views import number_of_axes
from escort_mj.native.lanes import WIDTH
from escort_mj.native.vectors import MOST_AXES

WOVEN = (2, 3)  # numbers of axes whose rows are read and written all at once


class VecType(types.Type):
    """Type of vectors in kernels, of so many axes; None where only the vector itself knows.

    Args:
        axes: How many.
        of: What components are: lanes, or numbers.
    """

    def __init__(self, axes: int | None, of: types.Type = lanes) -> None:
        self.axes, self.room, self.of = axes, axes or MOST_AXES, of
        self.item = LANES if of == lanes else ir.DoubleType()
        super().__init__(name=f"Vec({axes}, {of.name})")

    def wide(self, builder: Any, number: Any) -> Any:
        """Return a number as a component."""
        return spread(builder, number, LANES) if self.of == lanes else number


@register_model(VecType)
class _VecModel(models.StructModel):
    def __init__(self, manager: Any, kind: VecType) -> None:
        parts = [(f"x{k}", kind.of) for k in range(kind.room)]
        super().__init__(manager, kind, [*parts, ("axes", types.intp)])


def _parts(builder: Any, kind: VecType, value: Any) -> list[Any]:
    return [builder.extract_value(value, k) for k in range(kind.room)]


def _axes(builder: Any, kind: VecType, value: Any) -> Any:
    """How many axes a vector has."""
    return ir.IntType(64)(kind.axes) if kind.axes else builder.extract_value(value, kind.room)


def _packed(context: Any, builder: Any, kind: VecType, parts: Iterable[Any], axes: Any) -> Any:
    value = ir.Constant(context.get_value_type(kind), ir.Undefined)
    for k, part in enumerate((*parts, axes)):
        value = builder.insert_value(value, part, k)
    return value


def _sum(function: Any, generate: Callable[..., Any]) -> None:
    """Teaches kernels an operator of two vectors."""

    @infer_global(function)
    class Template(AbstractTemplate):
        def generic(self, arguments: Any, keywords: Any) -> Any:
            if len(arguments) == 2 and all(isinstance(kind, VecType) for kind in arguments):
                return signature(arguments[0], *arguments)
            return None

    @lower_builtin(function, VecType, VecType)
    def lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        kind = sig.return_type
        pairs = zip(*(_parts(builder, kind, value) for value in arguments), strict=True)
        found = [generate(builder, x, y) for x, y in pairs]
        return _packed(context, builder, kind, found, _axes(builder, kind, arguments[0]))


_sum(operator.add, add)
_sum(operator.sub, subtract)

_NUMBERS = (lanes, types.float64)


def _scaled(function: Any, vector: int, generate: Callable[..., Any]) -> None:
    """Teaches kernels an operator of a vector, the first or the second argument, and a number."""

    @infer_global(function)
    class Template(AbstractTemplate):
        def generic(self, arguments: Any, keywords: Any) -> Any:
            if len(arguments) != 2 or not isinstance(arguments[vector], VecType):
                return None
            number, kind = arguments[1 - vector], arguments[vector]
            number = types.float64 if isinstance(number, types.Number) else number
            if number not in (types.float64, kind.of):
                return None
            kinds = (kind, number)
            return signature(kinds[0], *(kinds if vector == 0 else kinds[::-1]))

    def lower(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        kind, value = sig.return_type, arguments[vector]
        number = kind.wide(builder, arguments[1 - vector])
        found = [generate(builder, x, number) for x in _parts(builder, kind, value)]
        return _packed(context, builder, kind, found, _axes(builder, kind, value))

    for number in _NUMBERS:
        lower_builtin(function, *((VecType, number) if vector == 0 else (number, VecType)))(lower)


_scaled(operator.mul, 0, lambda builder, x, y: multiply(builder, y, x))
_scaled(operator.mul, 1, lambda builder, x, y: multiply(builder, y, x))
_scaled(operator.truediv, 0, lambda builder, x, y: builder.fdiv(x, y))


@infer_global(operator.neg)
class _Negative(AbstractTemplate):
    def generic(self, arguments: Any, keywords: Any) -> Any:
        (kind,) = arguments
        return signature(kind, kind) if isinstance(kind, VecType) else None


@lower_builtin(operator.neg, VecType)
def _negative(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    kind, (value,) = sig.return_type, arguments
    found = [builder.fneg(x) for x in _parts(builder, kind, value)]
    return _packed(context, builder, kind, found, _axes(builder, kind, value))


@infer
class _Component(AbstractTemplate):
    key = "static_getitem"

    def generic(self, arguments: Any, keywords: Any) -> Any:
        vector, axis = arguments
        if not isinstance(vector, VecType) or not isinstance(axis, int):
            return None
        if vector.axes and not -vector.axes <= axis < vector.axes:
            raise TypingError(f"there is no axis {axis} of {vector.axes}")
        return signature(vector.of, *arguments)


@lower_builtin("static_getitem", VecType, types.Literal)
def _component(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    kind, value = sig.args[0], arguments[0]
    axis = arguments[1] if isinstance(arguments[1], int) else sig.args[1].literal_value
    if axis >= 0 or kind.axes:
        return builder.extract_value(value, axis % kind.room)
    found, last = ir.Constant(kind.item, None), _axes(builder, kind, value)
    for k, part in enumerate(_parts(builder, kind, value)):
        found = builder.select(builder.icmp_signed("==", last, last.type(k - axis)), part, found)
    return found


@infer_global(len)
class _Axes(AbstractTemplate):
    def generic(self, arguments: Any, keywords: Any) -> Any:
        (kind,) = arguments
        return signature(types.intp, kind) if isinstance(kind, VecType) else None


@lower_builtin(len, VecType)
def _count_axes(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
    return _axes(builder, sig.args[0], arguments[0])


@instructions_of(names.dot)
def _dot(context: Any, x: Any, y: Any) -> Any:
    if not (isinstance(x, VecType) and isinstance(y, VecType) and x.of == y.of):
        return None

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        (a, b), *others = zip(*(_parts(builder, x, value) for value in arguments), strict=True)
        found = builder.fmul(a, b)
        for a, b in others:  # in one order, whatever the compiler sees around it
            found = multiply_add(builder, a, b, found)
        return found

    return x.of(x, y), generate


@instructions_of(names.where)
def _where(context: Any, condition: Any, yes: Any, no: Any) -> Any:
    single = types.float64 if condition == types.boolean else lanes
    kind = next((side for side in (yes, no) if isinstance(side, VecType)), single)
    if kind == types.float64 and not all(isinstance(side, types.Number) for side in (yes, no)):
        return None

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        mask, *sides = arguments
        if kind == lanes:
            return builder.select(mask, *(spread(builder, side, LANES) for side in sides))
        if kind == types.float64:
            sides = [context.cast(builder, *pair, kind) for pair in zip(sides, (yes, no), strict=True)]
            return builder.select(mask, *sides)
        columns, axes = [], None
        for side, value in zip((yes, no), sides, strict=True):
            if isinstance(side, VecType):
                columns.append(_parts(builder, kind, value))
                axes = axes or _axes(builder, kind, value)
            else:
                columns.append([kind.wide(builder, value)] * kind.room)
        found = [builder.select(mask, *pair) for pair in zip(*columns, strict=True)]
        return _packed(context, builder, kind, found, axes)

    return kind(condition, yes, no), generate


@instructions_of(names.quarter_turn)
def _quarter_turn(context: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        first, second, *others = _parts(builder, x, arguments[0])
        found = [builder.fneg(second), first, *(ir.Constant(x.item, None) for _ in others)]
        return _packed(context, builder, x, found, _axes(builder, x, arguments[0]))

    return x(x), generate


@instructions_of(names.turned)
def _turned(context: Any, x: Any, first: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        parts, axes = _parts(builder, x, arguments[0]), _axes(builder, x, arguments[0])
        ways = [_turned_from(builder, parts, axes, begin) for begin in (0, 1)]
        begins = builder.icmp_signed("==", arguments[1], arguments[1].type(0))
        found = [builder.select(begins, *pair) for pair in zip(*ways, strict=True)]
        return _packed(context, builder, x, found, axes)

    return x(x, types.intp), generate


def _turned_from(builder: Any, parts: list[Any], axes: Any, begin: int) -> list[Any]:
    nothing = ir.Constant(parts[0].type, None)
    found = [nothing] * len(parts)
    for k in range(begin, len(parts) - 1, 2):
        whole = builder.icmp_signed("<", axes.type(k + 1), axes)
        found[k] = builder.select(whole, builder.fneg(parts[k + 1]), nothing)
        found[k + 1] = builder.select(whole, parts[k], nothing)
    return found


@instructions_of(names.unit_axis)
def _unit_axis(context: Any, x: Any, axis: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        axes, zero = _axes(builder, x, arguments[0]), ir.Constant(x.item, None)
        one = x.wide(builder, ir.DoubleType()(1.0))
        wanted = context.cast(builder, arguments[1], sig.args[1], types.intp)
        wanted = builder.select(
            builder.icmp_signed("<", wanted, wanted.type(0)), builder.add(wanted, axes), wanted
        )
        chosen = [builder.icmp_signed("==", wanted, wanted.type(k)) for k in range(x.room)]
        return _packed(context, builder, x, [builder.select(each, one, zero) for each in chosen], axes)

    return x(x, axis), generate


@instructions_of(names.of_numbers)
def _of_numbers(context: Any, x: Any, first: Any, second: Any, third: Any) -> Any:
    if not isinstance(x, VecType) or x.of != types.float64:
        return None

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        vector, *numbers = arguments
        axes, zero = _axes(builder, x, vector), ir.Constant(x.item, None)
        found = (numbers + [zero] * x.room)[: x.room]
        return _packed(context, builder, x, found, axes)

    return x(x, *[types.float64] * 3), generate


def _cast(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    return context.cast(builder, value, kind, types.intp)


def _read(state: Any, known: Callable[..., list[Any]], part: Callable[..., Any]) -> Any:
    """Make what reads a vector: all at once where axes are few and known, else part by part.

    Args:
        state: Type of the view of the state.
        known: Called with the builder, the array and the other arguments; reads all parts.
        part: Called likewise, and with the axis and the number of axes; reads one.
    """
    kind = VecType(state.axes)

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        array = make_array(sig.args[1])(context, builder, arguments[1])
        others = [
            value if of == lanes else _cast(context, builder, of, value)
            for of, value in zip(sig.args[2:], arguments[2:], strict=True)
        ]
        if kind.axes in WOVEN and known is not None:
            return _packed(context, builder, kind, known(builder, array, *others), ir.IntType(64)(kind.axes))
        word = ir.IntType(64)
        axes = word(kind.axes) if kind.axes else _axes_of(builder, array, sig.args[1])
        found = []
        for k in range(kind.room):
            there = None if kind.axes else builder.icmp_signed("<", word(k), axes)
            at = word(k) if there is None else builder.select(there, word(k), word(0))
            value = part(builder, array, at, axes, *others)
            found.append(value if there is None else builder.select(there, value, ir.Constant(LANES, None)))
        return _packed(context, builder, kind, found, axes)

    return kind, generate


def _axes_of(builder: Any, array: Any, kind: Any) -> Any:
    """Number of columns of a matrix, or of numbers of a vector."""
    return builder.extract_value(array.shape, kind.ndim - 1)


@instructions_of(names.rows_at)
def _rows_at(context: Any, state: Any, matrix: Any, i: Any) -> Any:
    def known(builder: Any, array: Any, i: Any) -> list[Any]:
        count: int = state.axes
        return read_woven(builder, array.data, builder.mul(i, i.type(count)), count)

    def part(builder: Any, array: Any, k: Any, axes: Any, i: Any) -> Any:
        return gather_at(builder, array.data, builder.add(builder.mul(i, axes), k), axes)

    kind, generate = _read(state, known, part)
    return kind(state, matrix, i), generate


@instructions_of(names.one_row)
def _one_row(context: Any, state: Any, vector: Any) -> Any:
    def part(builder: Any, array: Any, k: Any, axes: Any) -> Any:
        return spread(builder, builder.load(builder.gep(array.data, [k])), LANES)

    kind, generate = _read(state, None, part)  # type: ignore[arg-type]
    return kind(state, vector), generate


@instructions_of(names.numbers_from)
def _numbers_from(context: Any, state: Any, array: Any, at: Any) -> Any:
    kind, word = VecType(state.axes, types.float64), ir.IntType(64)

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        data = make_array(array)(context, builder, arguments[1]).data
        first, found = _cast(context, builder, at, arguments[2]), []
        if isinstance(state, VecType):
            axes = _axes(builder, state, arguments[0])
        else:
            axes = number_of_axes(context, builder, state, arguments[0])
        for k in range(kind.room):
            there = builder.icmp_signed("<", word(k), axes)
            place = builder.add(first, builder.select(there, word(k), word(0)))
            number = builder.load(builder.gep(data, [place]))
            found.append(builder.select(there, number, ir.Constant(kind.item, None)))
        return _packed(context, builder, kind, found, axes)

    return kind(state, array, at), generate


@instructions_of(names.set_numbers)
def _set_numbers(context: Any, array: Any, at: Any, x: Any) -> Any:
    kind = types.float64 if isinstance(x, types.Number | types.Boolean) else x
    if kind != types.float64 and not (isinstance(x, VecType) and x.of == types.float64):
        return None

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        data = make_array(array)(context, builder, arguments[0]).data
        first, word = _cast(context, builder, at, arguments[1]), ir.IntType(64)
        if kind == types.float64:
            builder.store(context.cast(builder, arguments[2], x, kind), builder.gep(data, [first]))
            return context.get_dummy_value()
        axes = _axes(builder, x, arguments[2])
        for k, part in enumerate(_parts(builder, x, arguments[2])):
            with builder.if_then(builder.icmp_signed("<", word(k), axes)):
                builder.store(part, builder.gep(data, [builder.add(first, word(k))]))
        return context.get_dummy_value()

    return types.void(array, at, x), generate


@instructions_of(names.rows_from)
def _rows_from(context: Any, state: Any, matrix: Any, rows: Any) -> Any:
    def part(builder: Any, array: Any, k: Any, axes: Any, rows: Any) -> Any:
        count, axis = (spread(builder, builder.sitofp(x, ir.DoubleType()), LANES) for x in (axes, k))
        return pick_at(builder, array.data, add(builder, multiply(builder, count, rows), axis))

    kind, generate = _read(state, None, part)  # type: ignore[arg-type]
    return kind(state, matrix, rows), generate


@instructions_of(names.part_at)
def _part_at(context: Any, state: Any, scratch: Any, at: Any) -> Any:
    kind = VecType(state.axes)

    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        data = make_array(scratch)(context, builder, arguments[1]).data
        first, word = _cast(context, builder, at, arguments[2]), ir.IntType(64)
        axes = number_of_axes(context, builder, state, arguments[0])
        found = []
        for k in range(kind.room):
            value = load_at(builder, data, builder.mul(builder.add(first, word(k)), word(WIDTH)))
            there = builder.icmp_signed("<", word(k), axes)
            found.append(builder.select(there, value, ir.Constant(LANES, None)))
        return _packed(context, builder, kind, found, axes)

    return kind(state, scratch, at), generate


@instructions_of(names.set_part)
def _set_part(context: Any, scratch: Any, at: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        data = make_array(scratch)(context, builder, arguments[0]).data
        first, word = _cast(context, builder, at, arguments[1]), ir.IntType(64)
        for k, part in enumerate(_parts(builder, x, arguments[2])):
            store_at(builder, data, builder.mul(builder.add(first, word(k)), word(WIDTH)), part)
        return context.get_dummy_value()

    return types.void(scratch, at, x), generate


@instructions_of(names.set_rows)
def _set_rows(context: Any, matrix: Any, i: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, arguments: Any) -> Any:
        data = make_array(matrix)(context, builder, arguments[0]).data
        first, word = _cast(context, builder, i, arguments[1]), ir.IntType(64)
        parts, axes = _parts(builder, x, arguments[2]), _axes(builder, x, arguments[2])
        begin = builder.mul(first, axes)
        if x.axes in WOVEN:
            write_woven(builder, data, begin, parts)
            return context.get_dummy_value()
        for k, part in enumerate(parts):
            at = builder.add(begin, word(k))
            if x.axes:
                scatter_at(builder, data, at, axes, part)
                continue
            with builder.if_then(builder.icmp_signed("<", word(k), axes)):
                scatter_at(builder, data, at, axes, part)
        return context.get_dummy_value()

    return types.void(matrix, i, x), generate
