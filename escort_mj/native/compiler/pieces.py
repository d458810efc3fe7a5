"""Compiles pieces of machine code and leaves them on disk, as `artifacts` loads them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from llvmlite import ir

from escort_mj.native import on_demand
from escort_mj.native.artifacts import Artifact
from escort_mj.native.compiler import EVERY_KERNEL
from escort_mj.native.compiler.declarations import ALONE, OPTIONS, teach, types_of
from escort_mj.native.compiler.numba_parts import (
    cpu_target,
    global_compiler_lock,
    njit,
    not_optimized,
    not_run,
    object_file,
    optimized,
)


def compile_piece(piece: Artifact) -> bytes:
    """Compile one piece.

    Returns:
        An object file.

    Raises:
        RuntimeError: If it needs what only a process with numba has.
    """
    for module in EVERY_KERNEL:
        import_module(module)
    function = getattr(import_module(piece.module), piece.function)
    if function not in on_demand.declared:
        function = function(piece.axes)  # it makes a callback
    teach()
    typed = types_of(function, piece.axes)
    with global_compiler_lock:
        with not_run(), not_optimized():
            dispatcher = njit(**ALONE, **OPTIONS)(function)
            dispatcher.compile(typed.args)
        library = _callable_from_c(str(piece), typed, dispatcher.overloads[typed.args])
        module = optimized(library)
        _check_names(piece, module)
        return object_file(module)


def _callable_from_c(symbol: str, typed: Any, compiled: Any) -> Any:
    """Everything that a compiled function needs as one optimized module, with a C function that calls it."""
    context = cpu_target.target_context
    library = context.codegen().create_library(symbol)
    module = library.create_ir_module(symbol)
    kinds = [context.get_value_type(kind) for kind in typed.args]
    function = ir.Function(module, ir.FunctionType(context.get_value_type(typed.return_type), kinds), symbol)
    builder = ir.IRBuilder(function.append_basic_block())
    callee = context.declare_function(module, compiled.fndesc)
    _, result = context.call_conv.call_function(builder, callee, typed.return_type, typed.args, function.args)
    builder.ret(result)
    library.add_ir_module(module)
    library.add_linking_library(compiled.library)
    with not_run():
        library.finalize()
    return library


def _check_names(piece: Artifact, module: Any) -> None:
    """Machine code is loaded where there is no numba: what it names must be elsewhere."""
    for function in module.functions:
        if function.is_declaration and function.name.startswith(("numba", "NRT_", "Py", "_Py")):
            raise RuntimeError(f"{piece}: uses {function.name}, which only numba has")
