"""Compiles all kernels that ship: `python -m escort_mj.native.compiler.ship`, for this machine's level.

With `--every-level` it compiles for every level that a wheel carries. What is there already stays.
"""

from __future__ import annotations

import argparse
import gc
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module

from escort_mj.native import levels, on_demand, shipped
from escort_mj.native.artifacts import Piece
from escort_mj.native.compiler import EVERY_KERNEL
from escort_mj.native.levels import Level


def every_piece() -> list[Piece]:
    """Return all that ships, what takes longest first."""
    import_module(EVERY_KERNEL)
    return [*on_demand.callbacks, *(entry.piece for entry in on_demand.entries.values())]


def ship(level: Level) -> None:
    """Compile everything for a level, on all cores."""
    folder = shipped.FOLDER / level.name
    if shipped.is_current(folder):
        return
    os.environ |= {"NUMBA_CPU_NAME": level.processor, "NUMBA_CPU_FEATURES": level.flags}
    pieces = every_piece()
    context = multiprocessing.get_context("spawn")  # numba reads the level when it is imported
    with ProcessPoolExecutor(mp_context=context, initializer=gc.disable) as pool:
        codes = list(pool.map(_compile, pieces))
    shipped.write(folder, {piece.file: code for piece, code in zip(pieces, codes, strict=True)})


def _compile(piece: Piece) -> bytes:
    from escort_mj.native.compiler.pieces import compile_piece

    return compile_piece(piece)


def main() -> None:
    """Compile for this machine's level, or for all."""
    parser = argparse.ArgumentParser(prog="python -m escort_mj.native.compiler.ship", description=__doc__)
    parser.add_argument("--every-level", action="store_true", help="every level that a wheel carries")
    for level in levels.SHIPPED if parser.parse_args().every_level else [levels.level()]:
        ship(level)


if __name__ == "__main__":
    main()
