"""Calls of one kernel out of several by its number, without a list of them anywhere else."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from escort_mj.native.kernels import inlined


def one_of(kernels: Sequence[Callable[..., Any]]) -> Callable[..., Any]:
    """Return a kernel that calls the one with a number, from 0, and the last one for any greater number.

    Args:
        kernels: With the same arguments and results each; the number comes before the arguments.
    """
    first, *others = kernels
    if not others:

        def last(number: int, *arguments: Any) -> Any:
            return first(*arguments)

        return inlined(last)
    other = one_of(others)

    def chosen(number: int, *arguments: Any) -> Any:
        if number == 0:
            return first(*arguments)
        return other(number - 1, *arguments)

    return inlined(chosen)
