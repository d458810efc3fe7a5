"""The machine instructions of what `kernels` only names: memory seen as arrays, loads, calls of C."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir

from escort_mj.native import kernels
from escort_mj.native.compiler.numba_parts import (
    cgutils,
    infer,
    infer_global,
    lower_builtin,
    make_array,
    make_intrinsic_template,
    populate_array,
    type_callable,
    types,
)
from escort_mj.native.kernels import DOUBLE, STACK_DOUBLES, matrix_at, vector_at


def instructions_of(function: Any) -> Callable[[Any], Any]:
    """Says by which instructions kernels do what a function names.

    What is decorated gets the typing context and the types of the arguments, and returns a signature and what
    generates the instructions, as numba's intrinsics do.
    """

    def declare(definition: Any) -> Any:
        template = make_intrinsic_template(function, definition, function.__name__)
        infer(template)
        infer_global(function, types.Function(template))
        return definition

    return declare


# Lowered by hand because numba's own `carray` needs reference counting.
@type_callable(matrix_at)
def _type_matrix(context: Any) -> Callable[..., types.Array]:
    return lambda address, rows, columns: types.Array(types.float64, 2, "C")


@type_callable(vector_at)
def _type_vector(context: Any) -> Callable[..., types.Array]:
    return lambda address, size: types.Array(types.float64, 1, "C")


@lower_builtin(matrix_at, types.Integer, types.Integer, types.Integer)
@lower_builtin(vector_at, types.Integer, types.Integer)
def _view(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    address, *shape = (
        context.cast(builder, value, kind, types.intp)
        for value, kind in zip(arguments, signature.args, strict=True)
    )
    item = context.get_constant(types.intp, DOUBLE)
    strides = [item] if len(shape) == 1 else [builder.mul(item, shape[1]), item]
    array = make_array(signature.return_type)(context, builder)
    data = builder.inttoptr(address, context.get_data_type(types.float64).as_pointer())
    populate_array(array, data=data, shape=shape, strides=strides, itemsize=item, meminfo=None)
    return array._getvalue()


@instructions_of(kernels.flat)
def _flat(context: Any, array: Any) -> Any:
    """Unlike numba's `reshape` it needs nothing of numba's when it runs."""
    if array.layout != "C":
        return None
    row = types.Array(array.dtype, 1, "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source = make_array(array)(context, builder, arguments[0])
        found, item = make_array(row)(context, builder), context.get_constant(types.intp, DOUBLE)
        populate_array(
            found, data=source.data, shape=[source.nitems], strides=[item], itemsize=item, meminfo=None
        )
        return found._getvalue()

    return row(array), generate


@instructions_of(kernels.stack_memory)
def _stack_memory(context: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        size = ir.IntType(64)(STACK_DOUBLES)
        memory = cgutils.alloca_once(builder, ir.DoubleType(), size=size)
        return builder.ptrtoint(memory, context.get_value_type(types.intp))

    return types.intp(), generate


def _loads(function: Any, kind: types.Type) -> None:
    """A function loads one value of a type from an address."""

    @instructions_of(function)
    def load(context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            pointer = builder.inttoptr(arguments[0], context.get_data_type(kind).as_pointer())
            return builder.load(pointer)

        return kind(types.intp), generate


_loads(kernels.double_at, types.float64)
_loads(kernels.int_at, types.int32)
_loads(kernels.pointer_at, types.intp)


@instructions_of(kernels.call_at)
def _call_at(context: Any, address: Any, arguments: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        kinds = [context.get_value_type(kind) for kind in signature.args[1]]
        function = builder.inttoptr(values[0], ir.FunctionType(ir.VoidType(), kinds).as_pointer())
        builder.call(function, cgutils.unpack_tuple(builder, values[1], len(kinds)))
        return context.get_dummy_value()

    return types.void(types.intp, arguments), generate


@instructions_of(kernels.call_function)
def _call_function(context: Any, address: Any, arguments: Any) -> Any:
    pair = types.UniTuple(types.intp, 2)

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        word = context.get_value_type(types.intp)
        given = cgutils.unpack_tuple(builder, values[1], len(signature.args[1]))
        result, error = (cgutils.alloca_once_value(builder, word(0)) for _ in range(2))
        kind = ir.FunctionType(ir.IntType(32), [result.type, error.type] + [word] * len(given))
        code = builder.call(builder.inttoptr(values[0], kind.as_pointer()), [result, error, *given])
        return context.make_tuple(builder, pair, [builder.sext(code, word), builder.load(result)])

    return pair(types.intp, arguments), generate


@instructions_of(kernels.data_address)
def _data_address(context: Any, array: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = make_array(signature.args[0])(context, builder, arguments[0]).data
        return builder.ptrtoint(data, context.get_value_type(types.intp))

    return types.intp(array), generate


@instructions_of(kernels.high_product)
def _high_product(context: Any, a: Any, b: Any) -> Any:
    if not (isinstance(a, types.Integer) and isinstance(b, types.Integer)):
        return None

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        wide = ir.IntType(128)
        product = builder.mul(builder.zext(arguments[0], wide), builder.zext(arguments[1], wide))
        return builder.trunc(builder.lshr(product, wide(64)), ir.IntType(64))

    return types.uint64(types.uint64, types.uint64), generate
