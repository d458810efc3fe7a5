"""Kernels that most missions never reach, compiled when one first does.

Compiling all of them at once takes longer than most missions. A kernel marked `on_demand` is no part of those
that call it: they find its address in a slot. While the slot is empty they ask
for it, and the process gets the kernel's machine code from the cache, or has it compiled. From then on a call
costs a load.

Machine code names slots; their addresses are found again by every process that loads it.
"""

from __future__ import annotations

import ctypes
import os
import threading
import time
import traceback
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from escort_mj import stopping
from escort_mj.native import artifacts
from escort_mj.native.artifacts import Artifact
from escort_mj.native.kernels import symbols

F = TypeVar("F", bound=Callable[..., Any])

CLASSES = (2, 3, None)  # numbers of axes that kernels know when they are compiled; None: any more
REQUEST = "escort_mj.native.on_demand.request"


class Entry(NamedTuple):
    """A kernel for one class of axes.

    Attributes:
        slot: Holds its address once it is there.
        piece: Which machine code it is.
        ships: Whether any mission reaches it.
    """

    slot: ctypes.c_void_p
    piece: Artifact
    ships: bool


declared: dict[Any, tuple[int | None, ...]] = {}
"""Kernels on demand, and the classes of axes that each is compiled for; None alone serves all missions."""
callbacks: list[Artifact] = []
"""What MuJoCo calls, of every class of axes."""
entries: dict[int, Entry] = {}  # by the slot's address
_waited = threading.local()


def on_demand(function: F) -> F:
    """Mark a kernel that is compiled when another kernel first reaches it, once for any number of axes.

    Args:
        function: Its annotations must say all types: numbers, views, and `Array` for one row of numbers. One
            view at least tells the class of axes.
    """
    return _declare(function, (None,))


def on_demand_unrolled(function: F) -> F:
    """As `on_demand`, but compiled for each class of axes: its loops over axes take much of many missions."""
    return _declare(function, CLASSES)


def on_demand_in_space(function: F) -> F:
    """As `on_demand_unrolled`, for what only missions in two or three axes reach: for more, none ships."""
    return _declare(function, CLASSES, in_space=True)


def _declare(function: F, classes: tuple[int | None, ...], in_space: bool = False) -> F:
    declared[function] = classes
    for axes in classes:
        piece = piece_of(function, axes)
        slot = ctypes.c_void_p()
        entries[ctypes.addressof(slot)] = Entry(slot, piece, not in_space or axes is not None)
        symbols[slot_name(piece)] = ctypes.addressof(slot)
    return function


def piece_of(function: Any, axes: int | None) -> Artifact:
    """Return the piece of a kernel, or of what makes a callback, that serves missions of so many axes."""
    known = axes if axes in declared.get(function, CLASSES) else None
    return Artifact(function.__module__, function.__qualname__, known)


def callback(*classes: int | None) -> Callable[[F], F]:
    """Mark a function that makes a callback for each of some classes of axes: it returns what is compiled."""

    def mark(function: F) -> F:
        callbacks.extend(piece_of(function, axes) for axes in classes)
        return function

    return mark


def slot_name(piece: Artifact) -> str:
    """Name of a kernel's slot in machine code."""
    return f"escort_mj.native.on_demand.{piece}"


def waited() -> float:
    """How long this thread has waited for kernels on demand so far [s]."""
    return getattr(_waited, "seconds", 0.0)


@ctypes.CFUNCTYPE(None, ctypes.c_void_p)
def _request(address: int) -> None:
    """Fills the slot at an address; machine code calls it, from any thread and without Python's lock.

    It calls again where Ctrl-C came between. Any other error ends the process: none can pass through the
    machine code that waits.
    """
    began = time.perf_counter()
    try:
        slot, piece, _ = entries[address]
        with stopping.deaf():
            slot.value = artifacts.address(piece)
    except KeyboardInterrupt:
        raise
    except BaseException:
        traceback.print_exc()
        os.abort()
    finally:
        _waited.seconds = waited() + time.perf_counter() - began


symbols[REQUEST] = ctypes.cast(_request, ctypes.c_void_p).value or 0
