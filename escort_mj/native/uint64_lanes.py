"""Whole numbers at once: unsigned words of 64 bits in the lanes of `lanes`, as random streams need them.

Kernels compute with them as with single words (+, -, *, ^, &, |, <<, >>, `high_product`) and mix both: what
they do with one word or with many is written once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from escort_mj.native.lanes import WIDTH


class Words:
    """The type as annotations name it."""

    __add__: Callable[[Words, Any], Words]
    __sub__: Callable[[Words, Any], Words]
    __rsub__: Callable[[Words, Any], Words]
    __mul__: Callable[[Words, Any], Words]
    __rmul__: Callable[[Words, Any], Words]
    __xor__: Callable[[Words, Any], Words]
    __and__: Callable[[Words, Any], Words]
    __or__: Callable[[Words, Any], Words]
    __lshift__: Callable[[Words, Any], Words]
    __rshift__: Callable[[Words, Any], Words]


def words_from(first: Any) -> Any:
    """A word in the first lane, and one more in each of the next."""
    return np.uint64(first) + np.arange(WIDTH, dtype=np.uint64)


def double_of(word: Any) -> Any:
    """The double that has these 64 bits; lanes of doubles for lanes of words."""
    return np.asarray(word, np.uint64).view(np.float64)[()]
