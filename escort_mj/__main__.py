"""The command line's way in: whatever takes time to import comes after signals are taken care of."""

from __future__ import annotations

from escort_mj import stopping


def main() -> None:
    """Entry point: runs a command of the command line."""
    stopping.command(_run)


def _run() -> None:
    from escort_mj.cli.app import run_command

    run_command()


if __name__ == "__main__":
    main()
