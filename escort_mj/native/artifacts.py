"""Compiled kernels on disk: where they are, and how this process gets them, with numba or without.

A piece of machine code is an object file as compilers write them. LLVM's linker puts it into memory and finds
what it names: slots of kernels on demand, functions of C. What is not on disk yet is compiled by processes
started for it, which import numba; this one waits.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Sequence
from typing import Any, NamedTuple

from escort_mj import stopping
from escort_mj.errors import CompilerMissingError
from escort_mj.native import cache, shipped
from escort_mj.native.kernels import symbols
from escort_mj.native.levels import level

PROCESSES = 2  # that compile at once
POLL = 0.1  # s between two looks at whether anybody still wants what is compiled
_lock = threading.RLock()  # threads that begin together compile once


class Artifact(NamedTuple):
    """What is compiled and loaded as one.

    Attributes:
        module: Where the function stands.
        function: Its name: a kernel on demand, or what makes a callback for so many axes.
        axes: Number of axes that the compiler knows; None for any more.
    """

    module: str
    function: str
    axes: int | None

    def __str__(self) -> str:
        return f"{self.module}.{self.function}.{self.axes}"

    @property
    def file(self) -> str:
        """Name of the object file."""
        return f"{self}.o"

    @classmethod
    def named(cls, text: str) -> Artifact:
        """The piece that has a text for its name."""
        module, function, axes = text.rsplit(".", 2)
        return cls(module, function, None if axes == "None" else int(axes))


def keep_artifact(piece: Artifact, code: bytes) -> None:
    """Write a piece to the cache."""
    cache.kernels.write(piece.file, code)


def kept(piece: Artifact) -> bytes | None:
    """A piece's machine code; None where it neither ships nor is in the cache."""
    return shipped.shipped_file(piece.file) or cache.kernels.read(piece.file)


def have(pieces: Sequence[Artifact]) -> None:
    """Compiles those of some pieces that are not on disk, side by side; begin with those that take longest.

    Raises:
        CompilerMissingError: If numba is not installed.
        Exception: What the compiler says of a kernel that is wrong.
        KeyboardInterrupt: If it comes, also to the thread that wants this thread's results.
    """
    missing = [piece for piece in pieces if piece not in _loaded and kept(piece) is None]
    if not missing:
        return
    if cache.version("numba") == "none":
        raise CompilerMissingError(f"no machine code of these sources ships for {level().name} processors")
    if "numba" not in sys.modules:  # else it is faster here
        _elsewhere(missing)
    for piece in missing:
        if kept(piece) is None:
            from importlib import import_module

            keep_artifact(piece, import_module("escort_mj.native.compiler.pieces").compile_piece(piece))


def _elsewhere(pieces: Sequence[Artifact]) -> None:
    """Has pieces compiled in processes of their own; where those cannot be started or fail, they are not."""
    left = list(pieces)
    running: list[subprocess.Popen[str]] = []
    ended = threading.Event()

    def serve() -> None:
        # -P: what lies in the user's folder by the name of a module is none of the compiler's.
        command = [sys.executable, "-P", "-m", "escort_mj.native.compiler", str(cache.kernels.folder)]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        try:
            with subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
                env=environment,
                start_new_session=True,
            ) as process:
                running.append(process)
                if ended.is_set():
                    process.kill()
                while left:
                    print(left.pop(0), file=process.stdin, flush=True)
                    if not process.stdout.readline():  # type: ignore[union-attr]
                        return
        except (OSError, IndexError):  # it does not start, or the other has taken the last
            return

    count = min(PROCESSES, os.cpu_count() or 1, len(left))
    servers = [threading.Thread(target=serve, daemon=True) for _ in range(count)]
    for server in servers:
        server.start()
    try:
        for server in servers:
            while server.is_alive():
                server.join(POLL)
                if stopping.asked():
                    raise KeyboardInterrupt
    except KeyboardInterrupt:
        ended.set()
        left.clear()
        for process in running:
            process.kill()
        for server in servers:  # one of them may be starting a process just now
            server.join()
        raise


_loaded: dict[Artifact, int] = {}
_linked: set[str] = set()  # names that the linker knows
_engines: list[Any] = []  # they own the memory that machine code lies in


def address(piece: Artifact) -> int:
    """Address of a piece's function in this process, compiled, loaded or known already."""
    with _lock:
        if piece not in _loaded:
            have([piece])
            code = kept(piece)
            if code is None:
                raise RuntimeError(f"{piece}: the compiler left no machine code in {cache.kernels.folder}")
            _loaded[piece] = _load(str(piece), code)
        return _loaded[piece]


class Plugged(NamedTuple):
    """Machine code of a plugin's function.

    Attributes:
        symbol: What the function is called in it.
        needs_numba: Whether it calls what only a process with numba has.
        code: An object file.
    """

    symbol: str
    needs_numba: bool
    code: bytes


PLUGGED, MOST_PLUGGED = "plugin.{}.o", 200  # files of plugins' functions in the cache, and how many are kept


def keep_plugged(name: str, plugged: Plugged) -> None:
    """Write the machine code of a plugin's function to the cache, by a name that tells its content."""
    head = json.dumps([plugged.symbol, plugged.needs_numba]).encode()
    cache.kernels.write(PLUGGED.format(name), head + b"\n" + plugged.code)
    cache.kernels.trim(PLUGGED.format("*"), MOST_PLUGGED)


def kept_plugged(name: str) -> Plugged | None:
    """Return the machine code of a plugin's function; None where it is not in the cache."""
    content = cache.kernels.read(PLUGGED.format(name))
    if content is None:
        return None
    head, _, code = content.partition(b"\n")
    symbol, needs_numba = json.loads(head)
    return Plugged(symbol, needs_numba, code)


def load_plugged(plugged: Plugged) -> int:
    """Link a plugin's function into this process; its address."""
    if plugged.needs_numba:
        from importlib import import_module

        import_module("escort_mj.native.compiler.plugged").give_names()
    with _lock:
        return _load(plugged.symbol, plugged.code)


def _load(symbol: str, code: bytes) -> int:
    """Links machine code into this process; address of the function that it has under a name."""
    import llvmlite.binding as llvm

    link_names()
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(jit=True)
    # llvmlite's own memory manager keeps the parts of an object file together.
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine, use_lmm=True)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    _engines.append(engine)
    return int(engine.get_function_address(symbol))


def link_names() -> None:
    """Tells LLVM's linker where this process has what machine code names."""
    import llvmlite.binding as llvm

    for symbol in symbols.keys() - _linked:
        llvm.add_symbol(symbol, symbols[symbol])
        _linked.add(symbol)
