"""Compiles pieces for another process, which names them line by line and is told of each that is done."""

import gc
import sys
from pathlib import Path

from escort_mj import cache, machine_code
from escort_mj.compiler.pieces import compile_piece

if __name__ == "__main__":
    gc.disable()  # looking for garbage took a fifth of the time, in vain
    folder = Path(sys.argv[1])
    cache.folder = lambda: folder  # type: ignore[assignment]  # a temporary one is known to nobody else
    for line in sys.stdin:
        compile_piece(machine_code.Piece.named(line.strip()))
        print(line.strip(), flush=True)
