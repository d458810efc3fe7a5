"""Compiles what plugins bring, in the process that runs it: functions of views, called as numba calls."""

from __future__ import annotations

import gc
import re
from pathlib import Path
from typing import Any

from escort_mj.native.artifacts import Plugged
from escort_mj.native.compiler import declarations, views
from escort_mj.native.compiler.numba_parts import (
    holds_addresses,
    njit,
    own_object_file,
    prepare_arrays,
    types,
)
from escort_mj.native.memory import Layout

View = tuple[str, Layout, type, int | None]
"""A name that tells its content, and what `views.name_view` takes."""


class NotCompiledError(Exception):
    """What a plugin brings cannot be compiled; says where and why in one line."""


_HOW = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}, **declarations.ALONE}


def in_kernels(function: Any) -> Any:
    """Return what calls a function in others that are compiled here."""
    declarations.teach()
    return function if hasattr(function, "py_func") else njit(forceinline=True, **_HOW)(function)


def compile_function(
    function: Any, given: tuple[View, ...], answers: str | None, of: Any = None, called: str = ""
) -> tuple[Any, int, Plugged | None]:
    """Compile a function.

    Unlike the package's own kernels it may make arrays, and is compiled with numba's reference counting.

    Args:
        function: Its arguments are views, and then perhaps a robot's number.
        given: The views.
        answers: What it returns, in words, empty for nothing; None where there is no robot's number.
        of: The plugin's function that it calls, for messages; None where it is the plugin's own.
        called: What it is called there; empty for the function's name.

    Returns:
        What must live as long as it is called; its address; and its machine code, for other processes, unless
        it holds what only this process has.

    Raises:
        NotCompiledError: If numba cannot.
    """
    declarations.teach()
    dispatcher = njit(**_HOW)(function)
    kinds = (*(views.name_view(*view) for view in given), *([types.intp] if answers is not None else []))
    collecting = gc.isenabled()
    gc.disable()
    try:
        dispatcher.compile(kinds)
    except Exception as error:  # numba has several roots of errors, and stumbles over some code
        raise NotCompiledError(_why(error, of or function, called or function.__name__)) from None
    finally:
        if collecting:
            gc.enable()
    (result,) = (each for each in dispatcher.overloads.values() if each.signature.args == kinds)
    returned = result.signature.return_type
    if answers is not None and not isinstance(returned, types.Integer if answers else types.NoneType):
        words = f"returns {returned}; expected {answers or 'nothing'} on every way out"
        raise NotCompiledError(f"{_place(function)}: {function.__name__} {words}")
    symbol = result.fndesc.llvm_func_name
    return dispatcher, result.library.get_pointer_to_function(symbol), _plugged(result.library, symbol)


# What is declared in LLVM's text, and the pointers to numba's environments, which hold Python's objects.
_DECLARED = re.compile(r'^declare [^@]*@"?(?:numba|NRT_|Py|_Py)', re.MULTILINE)
_ENVIRONMENT = re.compile(r"""@"?_ZN08NumbaEnv[^\s",=)]+""")


def _plugged(library: Any, symbol: str) -> Plugged | None:
    """The machine code of a library; None where it holds addresses or objects of this process."""
    text = library.get_llvm_str()
    environments = _ENVIRONMENT.findall(text)
    if holds_addresses(library) or len(environments) > len(set(environments)):
        return None
    return Plugged(symbol, _DECLARED.search(text) is not None, own_object_file(library))


def give_names() -> None:
    """Tell LLVM's linker where this process has numba's own functions, and prepare its memory of arrays."""
    prepare_arrays()


# What numba says of equations between values, and what that means.
_NO_FUNCTION = r"No implementation of function Function\(<"
_SAID = {
    _NO_FUNCTION + r"class 'bool'": "if, and, or and not take numbers, no values of all axes; use np.where",
    _NO_FUNCTION + r"built-in function getitem": "what is read has no such index",
    _NO_FUNCTION
    + r"(?:built-in )?\w+ '?(\w+)": "there is no {} of what it is given; docs/plugins.md lists what there is",
    r"'\w+' object has no attribute 'room'": "found a number; expected a vector, such as r.q",
    r"No definition for lowering .*\.(\w+) = ": "{} cannot be written",
}


def _place(function: Any) -> str:
    return f"{function.__code__.co_filename}:{function.__code__.co_firstlineno}"


def _why(error: Exception, function: Any, called: str) -> str:
    """What numba says of a kernel that it cannot compile, in one line."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(error))
    name = re.escape(Path(function.__code__.co_filename).name)
    lines = re.findall(rf'{name}(?:", line | \()(\d+)', text)
    said = [line.strip() for line in text.splitlines() if line.strip()]
    said = [line for line in said if not line.startswith(("Failed in nopython", "File ", "During:", "- "))]
    if "IMPORT_NAME" in text:
        said = ["it cannot import; import at the top of the file"]
    place = f"{function.__code__.co_filename}:{lines[-1]}" if lines else _place(function)
    return f"{place}: numba cannot compile {called}: {_plain(said[0]) if said else type(error).__name__}"


def _plain(said: str) -> str:
    """Say in words of equations what numba says in its own."""
    for sign, words in _SAID.items():
        if found := re.match(sign, said):
            return words.format(*found.groups())
    return said
