"""Levels of processors: machine code is compiled for a level, not for one processor, and can ship."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple


class Level(NamedTuple):
    """What machine code may count on.

    Attributes:
        name: Of the level; the folder of its machine code.
        processor: Whose costs LLVM weighs instructions by; empty for this machine's own.
        features: Instructions that every processor of the level has, in LLVM's words.
    """

    name: str
    processor: str
    features: tuple[str, ...]

    @property
    def flags(self) -> str:
        """The features as LLVM reads them; without those of AMD's that its processor would bring."""
        without = ("-sse4a",) if self.processor else ()
        return ",".join((*(f"+{feature}" for feature in self.features), *without))


_BASE = ("64bit", "cmov", "cx8", "fxsr", "mmx", "sse", "sse2")
_V2 = (*_BASE, "cx16", "popcnt", "sahf", "sse3", "sse4.1", "sse4.2", "ssse3")
_V3 = (*_V2, "avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "xsave")
_V4 = (*_V3, "avx512bw", "avx512cd", "avx512dq", "avx512f", "avx512vl")

# Tuned as for Zen 2: with LLVM's models of Zen 3 and Zen 4 a controlled step takes as long, within 3 %.
SHIPPED = (
    Level("x86_64-v4", "znver2", _V4),
    Level("x86_64-v3", "znver2", _V3),
    Level("x86_64-v2", "x86-64-v2", _V2),
)
"""Levels of which machine code ships, the highest first: those of the x86-64 psABI."""


@cache
def level() -> Level:
    """Return the highest level that this machine has; of another architecture, the machine itself."""
    import llvmlite.binding as llvm

    triple = llvm.get_process_triple()
    known = {name for name, has in llvm.get_host_cpu_features().items() if has}
    if triple.startswith("x86_64"):
        for each in SHIPPED:
            if known.issuperset(each.features):
                return each
    return Level(triple.partition("-")[0], "", tuple(sorted(known)))
