"""The command line's way in: whatever takes time to import comes after signals are taken care of."""

from __future__ import annotations

import gc
import os

from escort_mj import stopping, supervised

OBJECTS = 250_000
"""New objects after which Python looks for garbage: a run has fewer, and looking took a tenth of its time."""


def main() -> None:
    """Run a command: an interrupt becomes one line and exit code 130.

    Linear algebra gets one thread, unless the environment says how many: its matrices are small, and other
    cores compute other missions. Pydantic is not to look for plugins in everything that is installed.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "true")
    gc.set_threshold(OBJECTS)
    supervised.supervise(_command)


def _command(page: supervised.Page) -> None:
    """Run a command, and tell with which exit code it ends."""
    supervised.own_page = page
    code = supervised.BROKEN
    try:
        stopping.command(_run)
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
        raise
    finally:
        gc.freeze()  # nor does it look at the end
        page.end(code)


def _run() -> None:
    from escort_mj.cli.app import run_program

    run_program()


if __name__ == "__main__":
    main()
