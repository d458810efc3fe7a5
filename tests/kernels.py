"""Compiles the machine code that tests need, before they start: what ships, and their own (`make kernels`).

Without it every worker of pytest would find the same empty cache, and compile the same.
"""

from escort_mj.native import artifacts, levels
from escort_mj.native.artifacts import Piece
from escort_mj.native.compiler.ship import ship
from escort_mj.native.on_demand import CLASSES

TWINS = "tests.control.twins"


def main() -> None:
    """In the processes that compile what ships: most of what it calls is compiled there already."""
    pieces = [Piece(TWINS, "evaluation", axes) for axes in CLASSES]
    missing = [piece for piece in pieces if artifacts.kept(piece) is None]
    for piece, code in ship(levels.level(), missing).items():
        artifacts.keep_artifact(piece, code)


if __name__ == "__main__":
    main()
