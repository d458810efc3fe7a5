"""Makes all that ships for this machine's level: `python -m escort_mj.native.compiler.ship`.

With `--every-level` it compiles for every level that a wheel carries. What is there already stays.
"""

from __future__ import annotations

import argparse
import gc
import multiprocessing
import os
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from importlib import import_module
from threading import Lock

from escort_mj.native import levels, on_demand, shipped
from escort_mj.native.artifacts import Artifact
from escort_mj.native.compiler import EVERY_KERNEL, EVERY_TEXT
from escort_mj.native.levels import Level


def every_piece() -> list[Artifact]:
    """Return all that ships, what takes longest first."""
    for module in EVERY_KERNEL:
        import_module(module)
    return [*on_demand.callbacks, *(entry.piece for entry in on_demand.entries.values() if entry.ships)]


def every_text() -> dict[str, bytes]:
    """Return the texts that ship, by name."""
    made = (import_module(module).texts() for module in EVERY_TEXT)
    return {name: text.encode() for texts in made for name, text in texts.items()}


MANY_LEFT = 16  # pieces of a class: fewer are not worth compiling in a second process what they call


def ship(level: Level) -> None:
    """Compile for a level what ships, unless it is there."""
    folder = shipped.FOLDER / level.name
    if not shipped.is_current(folder):
        kernels = {piece.file: code for piece, code in _compiled(every_piece(), level).items()}
        shipped.write(folder, kernels | every_text())


def _compiled(pieces: Iterable[Artifact], level: Level) -> dict[Artifact, bytes]:
    """Compile pieces for a level, on all cores.

    What pieces of a class of axes call is compiled once in a process: each process stays with its class.
    """
    left = [[piece for piece in pieces if piece.axes == axes] for axes in on_demand.CLASSES]
    not_begun = sorted(filter(None, left), key=len)
    codes: dict[Artifact, bytes] = {}
    lock = Lock()

    def serve(_: int) -> None:
        context = multiprocessing.get_context("spawn")  # numba reads the level when it is imported
        mine: list[Artifact] = []
        with ProcessPoolExecutor(1, context, _begin, (level,)) as process:
            while True:
                with lock:
                    if not mine and not_begun:
                        mine = not_begun.pop()
                    elif not mine:
                        mine = max(left, key=len)
                        if len(mine) < MANY_LEFT:
                            return
                    piece = mine.pop(0)
                codes[piece] = process.submit(_compile, piece).result()

    count = min(os.cpu_count() or 1, sum(map(len, left)))
    if count:
        with ThreadPoolExecutor(count) as threads:
            list(threads.map(serve, range(count)))
    return codes


def _begin(level: Level) -> None:
    gc.disable()  # looking for garbage took a fifth of the time, in vain
    os.environ |= {"NUMBA_CPU_NAME": level.processor, "NUMBA_CPU_FEATURES": level.flags}


def _compile(piece: Artifact) -> bytes:
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
