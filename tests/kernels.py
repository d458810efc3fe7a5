"""Compiles the machine code that tests need, on all cores, before they start: `make kernels`.

Without it every worker of pytest would find the same empty cache, and compile the same.
"""

import gc
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor

from escort_mj.native import artifacts, on_demand
from escort_mj.native.artifacts import Piece
from escort_mj.native.compiler.pieces import compile_piece
from escort_mj.world.callback import class_pieces

TWINS = "tests.control.twins"


def pieces() -> Iterator[Piece]:
    """Those that take longest first."""
    for axes in (2, 3, None):
        yield from class_pieces(axes)
        yield Piece(TWINS, "evaluation", axes)
    for entry in on_demand.entries.values():
        yield entry.piece


def compile_if_missing(piece: Piece) -> None:
    """In a process of the pool."""
    if artifacts.kept(piece) is None:
        compile_piece(piece)


if __name__ == "__main__":
    with ProcessPoolExecutor(initializer=gc.disable) as pool:
        list(pool.map(compile_if_missing, dict.fromkeys(pieces())))
