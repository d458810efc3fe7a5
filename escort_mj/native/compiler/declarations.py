"""Teaches numba the kernels that are declared: how each is compiled, and what stands for it in others."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any, TypeVar

from llvmlite import ir

from escort_mj.native import artifacts, cache, kernels, memory, on_demand
from escort_mj.native import values as named
from escort_mj.native.compiler import lanes, machine, uint64_lanes, values, vectors, views  # noqa: F401
from escort_mj.native.compiler.numba_parts import (
    AbstractTemplate,
    ConcreteTemplate,
    cgutils,
    infer_global,
    keep_compiled_in,
    lower_builtin,
    njit,
    signature,
    types,
)

F = TypeVar("F", bound=Callable[..., Any])

# No reassociation and no "NaN cannot happen": kernels must agree with themselves interpreted and see a NaN.
# Kernels see borrowed memory only, so numba's reference counting (half of the time, else) is off.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "nogil": True, "_nrt": False}
# They are not called from Python or C.
ALONE = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
HOW: dict[str, dict[str, Any]] = {
    "kernel": {},
    "inlined": {"forceinline": True},
    "merged": {"inline": "always"},
}
_TYPES = {
    "None": types.void,
    "bool": types.boolean,
    "int": types.intp,
    "c_int": types.int32,
    "float": types.float64,
    "Array": types.Array(types.float64, 1, "C"),
}
_C_TYPES = {
    None: types.void,
    ctypes.c_double: types.float64,
    ctypes.c_int: types.int32,
    ctypes.c_void_p: types.intp,
}


def teach() -> None:
    """Tells numba of everything declared so far."""
    for viewed, function in _news(memory.viewers):
        layout, kind = viewed()
        views.teach_viewer(layout, kind, function)
    for kind, function in _news(memory.narrowers):
        views.teach_narrower(kind, function)
    for function, names in _news(named.readers):
        values.teach_axes(function, names)
    for how, function in _news(kernels.declared):
        _teach_kernel(how, function)
    for function, kind, names in _news(named.computed):
        values.teach_computed(function, kind, names, _inlined)
    for function, count, written in _news(named.numpy_forms):
        lanes.teach_function(function, count, written)
    for function in _news(on_demand.declared):
        _teach_on_demand(function)
    for function, what in _news(kernels.externals):
        _teach_external(function, what)
    for function, symbol, base in _news(kernels.places):
        _teach_place(function, symbol, base)
    artifacts.link_names()


_taught: dict[int, int] = {}


def _news(declared: Any) -> list[Any]:
    """What was declared since this was asked last."""
    begin, _taught[id(declared)] = _taught.get(id(declared), 0), len(declared)
    return list(declared)[begin:]


_kept: list[Any] = []  # numba's types hold them weakly


def _teach_kernel(how: str, function: Any) -> None:
    dispatcher = _dispatcher(how, function)
    if how == "merged":  # so numba knows what to merge
        function.py_func, function.targetoptions = function, HOW[how]
    infer_global(function, types.Dispatcher(dispatcher))


def _inlined(function: Any) -> Any:
    return _dispatcher("inlined", function)


def _dispatcher(how: str, function: Any) -> Any:
    dispatcher = njit(**HOW[how], **ALONE, **OPTIONS)(function)
    _kept.append(dispatcher)
    return dispatcher


def types_of(function: Any, axes: int | None) -> Any:
    """The types that a function's annotations say, for a class of axes."""
    result, *arguments = (
        _TYPES.get(said) or views.view_type(said, axes)
        for said in [function.__annotations__["return"]]
        + [said for name, said in function.__annotations__.items() if name != "return"]
    )
    return signature(result, *arguments)


def _axes(arguments: Any) -> int | None:
    """The class of axes that the views among a call's arguments belong to."""
    axes: int | None = next(kind.axes for kind in arguments if isinstance(kind, views.ViewType))
    return axes


def _teach_on_demand(function: Any) -> None:
    class Call(AbstractTemplate):
        key = function

        def generic(self, arguments: Any, keywords: Any) -> Any:
            assert not keywords
            return types_of(function, _axes(arguments))

    infer_global(function, types.Function(Call))

    @lower_builtin(function, types.VarArg(types.Any))
    def call(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """Asks for the kernel as long as its slot is empty, then calls what the slot holds."""
        piece = on_demand.piece_of(function, _axes(signature.args))
        address = context.get_value_type(types.voidptr)
        slot = cgutils.add_global_variable(builder.module, address, on_demand.slot_name(piece))
        ask, go = builder.append_basic_block("ask"), builder.append_basic_block("go")
        builder.cbranch(cgutils.is_null(builder, builder.load(slot)), ask, go).set_weights([1, 99])
        with builder.goto_block(ask):
            kind = ir.FunctionType(ir.VoidType(), [slot.type])
            builder.call(cgutils.get_or_insert_function(builder.module, kind, on_demand.REQUEST), [slot])
            builder.cbranch(cgutils.is_null(builder, builder.load(slot)), ask, go)
        builder.position_at_end(go)
        parameters = [context.get_value_type(kind) for kind in signature.args]
        kind = ir.FunctionType(context.get_value_type(signature.return_type), parameters)
        return builder.call(builder.bitcast(builder.load(slot), kind.as_pointer()), arguments)


def _teach_external(function: Any, what: kernels.External) -> None:
    result, *arguments = (_C_TYPES[kind] for kind in (what.result, *what.arguments))

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        kinds = [context.get_value_type(kind) for kind in signature.args]
        kind = ir.FunctionType(context.get_value_type(signature.return_type), kinds)
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, what.symbol), values)

    _teach_call(function, signature(result, *arguments), generate)


def _teach_place(function: Any, symbol: str, base: int) -> None:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        word = context.get_value_type(types.intp)
        known = builder.module.globals.get(symbol)
        found = known or cgutils.add_global_variable(builder.module, ir.IntType(8), symbol)
        return builder.sub(builder.ptrtoint(found, word), word(base))

    _teach_call(function, signature(types.intp), generate)


def _teach_call(function: Any, typed: Any, generate: Any) -> None:
    """A function of one signature, and its machine instructions."""

    class Call(ConcreteTemplate):
        key = function
        cases = [typed]

    infer_global(function, types.Function(Call))
    lower_builtin(function, *typed.args)(generate)


def jitted(function: F) -> F:
    """Compiles a function at its first call from Python: tests try kernels so."""
    keep_compiled_in(str(cache.kernels.folder))
    teach()
    compiled: F = njit(cache=True, **OPTIONS)(function)
    return compiled
