"""The one place that configures numba: how kernels are compiled and where their machine code is kept."""

from __future__ import annotations

import ctypes
import gc
import hashlib
import importlib.metadata
import os
import tempfile
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import llvmlite.binding
import numba
import numpy as np
import platformdirs
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.caching import IndexDataCacheFile
from numba.core.typing.templates import infer_global
from numba.extending import intrinsic, lower_builtin, register_jitable, type_callable
from numba.np.arrayobj import make_array, populate_array
from numpy.typing import NDArray

F = TypeVar("F", bound=Callable[..., Any])

# No reassociation and no "NaN cannot happen": kernels must agree with their NumPy twin and see a NaN.
# Kernels see borrowed memory only, so numba's reference counting (half of the time, else) is off.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "nogil": True, "_nrt": False}

DOUBLE = 8  # bytes


def sources(package: Path) -> list[Path]:
    """The files of the package that kernels and the constants in them come from, in order."""
    folders = (".", "control/**", "scenario", "world")
    return sorted({source for folder in folders for source in package.glob(f"{folder}/*.py")})


def cache_key(package: Path = Path(__file__).parent) -> str:
    """Digest of everything compiled kernels depend on.

    numba checks only the file a kernel stands in, not the kernels and constants that it uses, and not
    the layout of MuJoCo's structures. A folder per digest makes a stale kernel impossible.

    Args:
        package: Where the package is.
    """
    digest = hashlib.sha256()
    for name in ("mujoco", "numba", "llvmlite", "numpy"):
        digest.update(f"{name}={importlib.metadata.version(name)};".encode())
    for source in sources(package):
        content = source.read_bytes()
        digest.update(f"{source.relative_to(package).as_posix()}:{len(content)};".encode())
        digest.update(content)
    return digest.hexdigest()[:16]


def _cache_folder() -> str:
    """Folder for compiled kernels, by their key; a private temporary one where nothing can be written."""
    asked = os.environ.get("NUMBA_CACHE_DIR")
    folder = Path(asked) if asked else platformdirs.user_cache_path("escort_mj") / "kernels"
    folder /= cache_key()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return str(folder)
    except OSError:
        pass
    return tempfile.mkdtemp(prefix="escort_mj-kernels-")


# LLVM's model of Zen 3 and later unrolls the law's short loops until they miss the instruction cache:
# tuned as for Zen 2, with all features of the machine, a controlled step takes 6 % less.
if numba.config.CPU_NAME is None and llvmlite.binding.get_host_cpu_name() in ("znver3", "znver4", "znver5"):
    numba.config.CPU_NAME = "znver2"
numba.config.CACHE_DIR = _cache_folder()


def _name_of_code(self: Any, number: int) -> str:
    """File name of one piece of machine code, which no other process chooses.

    numba numbers the pieces of a kernel. Two processes that compile it for other types at the same moment
    choose the same number, and what one of them wrote stands for what the other did.
    """
    return f"{self._index_name.removesuffix('.nbi')}.{uuid.uuid4().hex[:16]}.nbc"


IndexDataCacheFile._data_name = _name_of_code


@contextmanager
def compiling() -> Iterator[None]:
    """Lets garbage lie while kernels are compiled: looking for it took a fifth of the time, in vain."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def kernel(function: F) -> F:
    """Compiles a function of numbers and arrays to machine code at its first call, and caches it."""
    compiled: F = numba.njit(cache=True, **OPTIONS)(function)
    return compiled


_inlined: list[Any] = []  # numba's types hold them weakly


def inlined(function: F) -> F:
    """For small functions that LLVM is to merge into the kernels that call them; plain Python to Python.

    They are no kernels by themselves: nobody calls their machine code, so none is wrapped or kept.
    """
    alone = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    dispatcher = numba.njit(forceinline=True, **alone, **OPTIONS)(function)
    _inlined.append(dispatcher)
    infer_global(function, types.Dispatcher(dispatcher))
    return function


def merged(function: F) -> F:
    """Like `inlined`, but merged before types are known: what is used once compiles a little faster so.

    It also keeps what the caller knows of its arguments, such as a literal number of axes.
    """
    compiled: F = numba.njit(inline="always", **OPTIONS)(function)
    return compiled


def shared(function: F) -> F:
    """Compiled when a kernel calls it, and plain Python when Python does."""
    both: F = register_jitable(**OPTIONS)(function)
    return both


def matrix_at(address: int, rows: int, columns: int) -> NDArray[np.float64]:
    """Views memory as a matrix of doubles, shape (rows, columns); nothing is copied or owned."""
    if rows * columns == 0:
        return np.zeros((rows, columns))
    memory = (ctypes.c_double * (rows * columns)).from_address(address)
    return np.ctypeslib.as_array(memory).reshape(rows, columns)


def vector_at(address: int, size: int) -> NDArray[np.float64]:
    """Views memory as a vector of doubles, shape (size,); nothing is copied or owned."""
    return matrix_at(address, 1, size)[0]


# Inside kernels the two above are a handful of machine instructions. They are lowered by hand because
# numba's own `carray` needs the reference counting that OPTIONS turns off.
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


STACK_DOUBLES = 192  # the most that a kernel takes in nine axes: 2 p^2 numbers


@intrinsic
def stack_memory(context: Any) -> Any:
    """Address of STACK_DOUBLES doubles on the machine's stack: scratch that nothing else can alias."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        size = ir.IntType(64)(STACK_DOUBLES)
        memory = cgutils.alloca_once(builder, ir.DoubleType(), size=size)
        return builder.ptrtoint(memory, context.get_value_type(types.intp))

    return types.intp(), generate


def _loader(kind: types.Type) -> Any:
    """An intrinsic that loads one value of a type from an address."""

    @intrinsic
    def load(context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            pointer = builder.inttoptr(arguments[0], context.get_data_type(kind).as_pointer())
            return builder.load(pointer)

        return kind(types.intp), generate

    return load


double_at = _loader(types.float64)
int_at = _loader(types.int32)
pointer_at = _loader(types.intp)
