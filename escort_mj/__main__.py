"""The command line's way in: whatever takes time to import comes after signals are taken care of."""

from __future__ import annotations

import os

from escort_mj import stopping


def main() -> None:
    """Run a command: an interrupt becomes one line and exit code 130.

    Linear algebra gets one thread, unless the environment says how many: its matrices are small, and other
    cores compute other missions.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    stopping.command(_run)


def _run() -> None:
    from escort_mj.cli.app import run_program

    run_program()


if __name__ == "__main__":
    main()
