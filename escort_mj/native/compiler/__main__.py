"""Compiles pieces for another process, which names them line by line and is told of each that is done."""

import gc
import os
import queue
import sys
import threading
from pathlib import Path

from escort_mj.native import artifacts, cache


def answer(lines: "queue.SimpleQueue[str]") -> None:
    """Hands on what the other process asks for; ends this one when that is gone or wants nothing more."""
    for line in sys.stdin:
        lines.put(line.strip())
    os._exit(0)


if __name__ == "__main__":
    asked: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=answer, args=(asked,), daemon=True).start()
    from escort_mj.native.compiler.pieces import compile_piece

    gc.disable()  # looking for garbage took a fifth of the time, in vain
    folder = Path(sys.argv[1])
    cache.kernels.folder = folder  # a temporary one is known to this process alone
    while True:
        name = asked.get()
        piece = artifacts.Artifact.named(name)
        artifacts.keep_artifact(piece, compile_piece(piece))
        print(name, flush=True)
