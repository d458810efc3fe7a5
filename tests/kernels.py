"""Compiles the machine code that tests need beside what ships, before they start: `make kernels`.

Without it every worker of pytest would find the same empty cache, and compile the same.
"""

import gc
from concurrent.futures import ProcessPoolExecutor

from escort_mj.native import artifacts
from escort_mj.native.artifacts import Piece
from escort_mj.native.compiler.pieces import compile_piece
from escort_mj.native.on_demand import CLASSES

TWINS = "tests.control.twins"


def compile_if_missing(axes: int | None) -> None:
    """In a process of the pool."""
    piece = Piece(TWINS, "evaluation", axes)
    if artifacts.kept(piece) is None:
        artifacts.keep_artifact(piece, compile_piece(piece))


if __name__ == "__main__":
    with ProcessPoolExecutor(initializer=gc.disable) as pool:
        list(pool.map(compile_if_missing, CLASSES))
