"""Calls of one kernel out of several by its number, or of all in turn, without a list of them elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import reduce
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


def in_turn(made: Callable[..., Any], calls: Iterable[Callable[..., Any]]) -> Callable[..., Any]:
    """Return what calls several functions one after another, with the same arguments; it returns nothing.

    Args:
        made: Makes a function callable in kernels.
        calls: Made so; there may be none.
    """

    def nothing(*arguments: Any) -> None:
        return

    def both(before: Callable[..., Any], after: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> None:
            before(*arguments)
            after(*arguments)

        return made(call)

    return reduce(both, calls, made(nothing))
