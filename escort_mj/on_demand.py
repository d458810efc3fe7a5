"""Kernels that most missions never reach, compiled when one first does.

Compiling all of them at once takes longer than most missions. A kernel marked `on_demand` is no part of those
that call it: they find its address in a slot, one for each class of axes. While the slot is empty they ask
for it, and the process compiles the kernel or reads it from the cache. From then on a call costs a load.

Compiled code names slots; their addresses are found anew by every process that loads it.
"""

from __future__ import annotations

import ctypes
import os
import traceback
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import llvmlite.binding
import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin

from escort_mj.kernels import OPTIONS, compiling
from escort_mj.memory import ViewType, view_type

F = TypeVar("F", bound=Callable[..., Any])

CLASSES = (2, 3, None)  # numbers of axes that kernels know when they are compiled; None: any more
_TYPES = {
    "None": types.void,
    "bool": types.boolean,
    "int": types.intp,
    "float": types.float64,
    "Array": types.Array(types.float64, 1, "C"),
}
_REQUEST = "escort_mj.on_demand.request"


class _Entry(NamedTuple):
    """A kernel for one class of axes.

    Attributes:
        slot: Holds its address once it is compiled.
        dispatcher: Compiles it.
        axes: The class.
    """

    slot: ctypes.c_void_p
    dispatcher: Any
    axes: int | None


_entries: dict[int, _Entry] = {}  # by the slot's address


def on_demand(function: F) -> F:
    """Marks a kernel that is compiled when another kernel first reaches it.

    Args:
        function: Its annotations must say all types: numbers, views, and `Array` for one row of numbers. One
            view at least tells the class of axes.
    """
    dispatcher = numba.njit(cache=True, no_cpython_wrapper=True, **OPTIONS)(function)
    name = f"{function.__module__}.{function.__qualname__}"
    for axes in CLASSES:
        slot = ctypes.c_void_p()
        _entries[ctypes.addressof(slot)] = _Entry(slot, dispatcher, axes)
        llvmlite.binding.add_symbol(_symbol(name, axes), ctypes.addressof(slot))

    class Call(AbstractTemplate):
        key = function

        def generic(self, arguments: Any, keywords: Any) -> Any:
            assert not keywords
            return _signature(function, _axes(arguments))

    infer_global(function, types.Function(Call))

    @lower_builtin(function, types.VarArg(types.Any))
    def call(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address = context.get_value_type(types.voidptr)
        slot = cgutils.add_global_variable(builder.module, address, _symbol(name, _axes(signature.args)))
        with builder.if_then(cgutils.is_null(builder, builder.load(slot)), likely=False):
            kind = ir.FunctionType(ir.VoidType(), [slot.type])
            builder.call(cgutils.get_or_insert_function(builder.module, kind, _REQUEST), [slot])
        parameters = [context.get_value_type(kind) for kind in signature.args]
        kind = ir.FunctionType(context.get_value_type(signature.return_type), parameters)
        return builder.call(builder.bitcast(builder.load(slot), kind.as_pointer()), arguments)

    return function


def _symbol(name: str, axes: int | None) -> str:
    """Name of a kernel's slot in compiled code."""
    return f"escort_mj.on_demand.{name}.{axes}"


def _axes(arguments: Any) -> int | None:
    """The class of axes that the views among a call's arguments belong to."""
    axes: int | None = next(kind.axes for kind in arguments if isinstance(kind, ViewType))
    return axes


def _signature(function: Any, axes: int | None) -> Any:
    """The types that a kernel's annotations say, for a class of axes."""
    result, *arguments = (
        _TYPES.get(said) or view_type(said, axes)
        for said in [function.__annotations__["return"]]
        + [said for name, said in function.__annotations__.items() if name != "return"]
    )
    return signature(result, *arguments)


def fetch(function: Any, axes: int | None) -> None:
    """Compiles a kernel for a class of axes before it is reached, or reads it from the cache."""
    for entry in _entries.values():
        if entry.dispatcher.py_func is function and entry.axes == axes:
            _fill(entry)


def _fill(entry: _Entry) -> None:
    wanted = _signature(entry.dispatcher.py_func, entry.axes)
    with compiling():
        entry.dispatcher.compile(wanted)
    result = entry.dispatcher.overloads[wanted.args]
    entry.slot.value = result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name)


@ctypes.CFUNCTYPE(None, ctypes.c_void_p)
def _request(address: int) -> None:
    """Fills the slot at an address; compiled code calls it, from any thread and without Python's lock."""
    try:
        _fill(_entries[address])
    except BaseException:  # no error can pass through the compiled code that waits for an address
        traceback.print_exc()
        os.abort()


llvmlite.binding.add_symbol(_REQUEST, ctypes.cast(_request, ctypes.c_void_p).value)
