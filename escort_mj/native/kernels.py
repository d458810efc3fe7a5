"""What kernels are: functions of numbers and of views of memory, written in Python, that become machine code.

The decorators say how; nothing is compiled here, and in Python a kernel stays the Python that it is. Only
`compiler` imports numba, mostly in a process of its own; `artifacts` loads what came of it. So a process
that finds its machine code on disk never imports numba.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from functools import cache, wraps
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

F = TypeVar("F", bound=Callable[..., Any])

DOUBLE = 8  # bytes
NOT_NULL = 4096  # where named numbers count from: no name stands for address 0
STACK_DOUBLES = 288  # the most that a kernel takes in nine axes: 24 constraints, and what is wanted


class External(NamedTuple):
    """A C function that kernels call.

    Attributes:
        symbol: Its name in machine code.
        result: ctypes type of what it returns.
        arguments: Those of its arguments.
    """

    symbol: str
    result: Any
    arguments: tuple[Any, ...]


declared: list[tuple[str, Any]] = []
"""How kernels are compiled, and which: "kernel", "inlined" or "merged"."""
externals: list[tuple[Any, External]] = []
places: list[tuple[Any, str, int]] = []
"""Functions that return an address or a number, its name in machine code, and where its value counts from."""
symbols: dict[str, int] = {}
"""What machine code names, and where this process has it."""


def kernel(function: F) -> F:
    """Compiled by itself, and called by the kernels that use it."""
    declared.append(("kernel", function))
    return function


def inlined(function: F) -> F:
    """For functions that LLVM is to merge into the kernels that call them."""
    declared.append(("inlined", function))
    return function


@cache
def inlined_once(function: Any) -> Any:
    """Like `inlined`, for what several components inherit."""
    return inlined(function)


def merged(function: F) -> F:
    """Like `inlined`, but merged before types are known: what is used once compiles a little faster so.

    It also keeps what the caller knows of its arguments, such as a literal number of axes.
    """
    declared.append(("merged", function))
    return function


def reachable(function: F, name: str) -> F:
    """Give a function that another one made a name in its module, by which machine code is looked up."""
    function.__name__ = function.__qualname__ = name
    setattr(sys.modules[function.__module__], name, function)
    return function


def external(address: int, result: Any, *arguments: Any) -> Callable[[F], F]:
    """Mark what stands for a C function, which kernels call, compiled or interpreted.

    Args:
        address: Of the C function in this process.
        result: ctypes type of what it returns.
        arguments: Those of its arguments.
    """

    def declare(function: F) -> F:
        symbol = f"{function.__module__}.{function.__qualname__}"
        symbols[symbol] = address
        call = ctypes.CFUNCTYPE(result, *arguments)(address)

        @wraps(function)
        def from_python(*values: Any) -> Any:
            return call(*values)

        externals.append((from_python, External(symbol, result, arguments)))
        return from_python  # type: ignore[return-value]

    return declare


def place(symbol: str, address: int) -> Callable[[], int]:
    """A function that returns an address, which machine code has a name for: it holds in any process."""
    return _named(symbol, address, 0)


def number(symbol: str, value: int) -> Callable[[], int]:
    """A function that returns a number of this process, for which machine code has a name and no value.

    The linker fills it in, as a constant.

    Args:
        symbol: The name.
        value: The number in this process, not negative.
    """
    return _named(symbol, value, NOT_NULL)


def _named(symbol: str, value: int, base: int) -> Callable[[], int]:
    def found() -> int:
        return value

    symbols[symbol] = base + value
    places.append((found, symbol, base))
    return found


# Inside compiled kernels these are a handful of machine instructions, which `compiler` says; interpreted ones
# run what stands here.


def matrix_at(address: int, rows: int, columns: int) -> NDArray[np.float64]:
    """Views memory as a matrix of doubles, shape (rows, columns); nothing is copied or owned."""
    if rows * columns == 0:
        return np.zeros((rows, columns))
    memory = (ctypes.c_double * (rows * columns)).from_address(address)
    return np.ctypeslib.as_array(memory).reshape(rows, columns)


def vector_at(address: int, size: int) -> NDArray[np.float64]:
    """Views memory as a vector of doubles, shape (size,); nothing is copied or owned."""
    return matrix_at(address, 1, size)[0]


def flat(array: NDArray[np.float64]) -> NDArray[np.float64]:
    """An array's numbers in a row, where they lie."""
    return array.reshape(-1)


def double_at(address: int) -> float:
    """The double at an address."""
    return ctypes.c_double.from_address(address).value


def int_at(address: int) -> int:
    """The 32-bit integer at an address."""
    return ctypes.c_int32.from_address(address).value


def pointer_at(address: int) -> int:
    """The address at an address."""
    return ctypes.c_ssize_t.from_address(address).value


_stacks: list[NDArray[np.float64]] = []
"""Scratch of interpreted kernels, which lives until the outermost of them returns."""


def stack_memory() -> int:
    """Address of STACK_DOUBLES doubles on the machine's stack: scratch that nothing else can alias."""
    _stacks.append(np.zeros(STACK_DOUBLES))
    return int(_stacks[-1].ctypes.data)


def interpreted(kernel: Callable[..., None]) -> Callable[..., None]:
    """Return what runs a kernel as plain Python, for callers outside of kernels.

    Its arithmetic is the machine's: what is divided by zero is infinite or no number, without a warning.
    """

    @wraps(kernel)
    def run(*arguments: Any) -> None:
        try:
            with np.errstate(all="ignore"):
                kernel(*arguments)
        finally:
            _stacks.clear()

    return run


def call_at(address: int, arguments: tuple[Any, ...]) -> None:
    """Call the C function at an address, which takes whole numbers and returns nothing."""
    ctypes.CFUNCTYPE(None, *[ctypes.c_ssize_t] * len(arguments))(address)(*arguments)


def call_function(address: int, arguments: tuple[int, ...]) -> tuple[int, int]:
    """Call a function that numba compiled with whole numbers; give its status and what it returned."""
    result, error = ctypes.c_ssize_t(), ctypes.c_ssize_t()
    words = [ctypes.c_ssize_t] * len(arguments)
    kind = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *words)
    status = kind(address)(ctypes.addressof(result), ctypes.addressof(error), *arguments)
    return status, result.value


def data_address(array: NDArray[np.float64]) -> int:
    """Address of an array's first number."""
    return int(array.ctypes.data)


def view_addresses(view: Any) -> tuple[int, int]:
    """Addresses of the plan, and of the state, that a view of the state reads."""
    found: tuple[int, int] = view.addresses
    return found


_LOW, _HALF = np.uint64(2**32 - 1), np.uint64(32)


def high_product(a: Any, b: Any) -> Any:
    """Upper 64 bits of the 128-bit product of two unsigned words."""
    a, b = np.asarray(a, np.uint64), np.asarray(b, np.uint64)
    a_low, a_high, b_low, b_high = a & _LOW, a >> _HALF, b & _LOW, b >> _HALF
    across = a_high * b_low + (a_low * b_low >> _HALF)
    other = a_low * b_high + (across & _LOW)
    return (a_high * b_high + (across >> _HALF) + (other >> _HALF))[()]
