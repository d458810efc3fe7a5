"""All of numba that the compiler uses: the only module that imports it.

What `numba` and `numba.extending` offer is public. The rest is not, and may move with any release: a test
holds it against the releases that were tried.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import llvmlite.binding as llvm
from numba import config, njit, types
from numba.core import cgutils, codegen
from numba.core.compiler_lock import global_compiler_lock
from numba.core.errors import TypingError
from numba.core.registry import cpu_target
from numba.core.runtime import rtsys
from numba.core.typing.templates import (
    AbstractTemplate,
    AttributeTemplate,
    CallableTemplate,
    ConcreteTemplate,
    infer,
    infer_global,
    make_intrinsic_template,
    signature,
)
from numba.extending import (
    infer_getattr,
    lower_builtin,
    lower_getattr_generic,
    models,
    overload,
    register_model,
    type_callable,
)
from numba.np.arrayobj import make_array, populate_array

from escort_mj.native.levels import level

TRIED = ("0.61", "0.63", "0.68")
"""Releases of numba with which kernels were compiled and linked; with the last, all tests ran."""

if config.CPU_NAME is None and level().processor:
    config.CPU_NAME, config.CPU_FEATURES = level().processor, level().flags

__all__ = [
    "AbstractTemplate",
    "AttributeTemplate",
    "CallableTemplate",
    "ConcreteTemplate",
    "TypingError",
    "cgutils",
    "cpu_target",
    "global_compiler_lock",
    "holds_addresses",
    "infer",
    "infer_getattr",
    "infer_global",
    "keep_compiled_in",
    "lower_builtin",
    "lower_getattr_generic",
    "make_array",
    "make_intrinsic_template",
    "models",
    "njit",
    "not_optimized",
    "not_run",
    "object_file",
    "optimized",
    "overload",
    "own_object_file",
    "populate_array",
    "prepare_arrays",
    "register_model",
    "signature",
    "type_callable",
    "types",
]


def not_run() -> AbstractContextManager[None]:
    """What is compiled inside is not put into memory."""
    return _skipping(
        (codegen.JITCodeLibrary, "_finalize_specific"),
        (codegen.JITCPUCodegen, "_add_module"),
        (codegen.JITCPUCodegen, "set_env"),
    )


def not_optimized() -> AbstractContextManager[None]:
    """What is compiled inside is left as it is: it is optimized together with what it becomes a part of."""
    return _skipping((codegen.CPUCodeLibrary, "_optimize_final_module"))


@contextmanager
def _skipping(*skipped: tuple[Any, str]) -> Iterator[None]:
    """Methods of numba's classes that do nothing inside."""
    before = [getattr(owner, name) for owner, name in skipped]
    for owner, name in skipped:
        setattr(owner, name, lambda *arguments: None)
    try:
        yield
    finally:
        for (owner, name), method in zip(skipped, before, strict=True):
            setattr(owner, name, method)


def optimized(library: Any) -> Any:
    """Return a finished library's module of LLVM."""
    return library._final_module


def object_file(module: Any) -> bytes:
    """Return a module as machine code.

    On x86 it reaches its constants, which are loaded beside it, relative to itself. By absolute addresses, as
    numba's own machine code does, each takes an instruction more and ten bytes.
    """
    near = {"reloc": "pic", "codemodel": "small"} if level().processor else {}
    machine = llvm.Target.from_default_triple().create_target_machine(
        cpu=config.CPU_NAME or llvm.get_host_cpu_name(),
        features=config.CPU_FEATURES or level().flags,
        opt=3,
        jit=True,
        **near,
    )
    return bytes(machine.emit_object(module))


def holds_addresses(library: Any) -> bool:
    """Whether a finished library holds addresses of this process."""
    return bool(library.has_dynamic_globals)


def own_object_file(library: Any) -> bytes:
    """Return a finished library as machine code, without what it is linked with."""
    _, _, (code, _) = library.serialize_using_object_code()
    return bytes(code)


def prepare_arrays() -> None:
    """Prepare numba's memory of arrays, and tell LLVM's linker where this process has its functions."""
    rtsys.initialize(cpu_target.target_context)


def keep_compiled_in(folder: str) -> None:
    """Have numba's own cache in a folder."""
    config.CACHE_DIR = folder
