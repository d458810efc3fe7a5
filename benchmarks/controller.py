"""The controller without the simulator: time per call, and a fresh process to its first command.

`python -m benchmarks.controller` prints the tables; with `--docs` it puts them into docs/real_robots.md.
The time per call is that of the fastest of many short batches: what other programs took is left out.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.document import measure_page, table
from benchmarks.start import process
from escort_mj import Controller

PAGE = "real_robots.md"
BATCHES, CALLS = 300, 50
PROCESSES = 9
HUNDRED = {"robots": {"count": 100, "placement": {"within": 60}}, "mission": {"radius": 30}}
CASES: dict[str, Any] = {
    "5 robots, plane": "main",
    "6 robots, space": "main_3d",
    "100 robots, plane": HUNDRED,
}
FIRST = """
from escort_mj import Controller
controller = Controller("main")
controller(0.0, controller.start, 0.0 * controller.start)
"""


def fastest(call: Callable[[], object], calls: int = CALLS, batches: int = BATCHES) -> float:
    """Time of one call in the fastest batch [us]."""
    found = np.inf
    for _ in range(batches):
        began = time.perf_counter()
        for _ in range(calls):
            call()
        found = min(found, (time.perf_counter() - began) / calls)
    return 1e6 * found


def per_call(scenario: Any, backend: str, **batches: int) -> tuple[float, float]:
    """Time of one call and of reading all signals [us], of robots that stand still."""
    controller = Controller(scenario, backend=backend)  # type: ignore[arg-type]
    q, v, step = controller.start, np.zeros_like(controller.start), 0

    def call() -> None:
        nonlocal step
        controller(step * controller.timestep, q, v)
        step += 1

    call()
    return fastest(call, **batches), fastest(lambda: controller.signals, **batches)


def tables() -> dict[str, str]:
    """Measure, and print or publish."""
    rows = []
    for name, scenario in CASES.items():
        native, signals = per_call(scenario, "native")
        python, _ = per_call(scenario, "interpreted", calls=1, batches=20)
        rows.append([name, f"{native:.0f}", f"{signals:.0f}", f"{python:.0f}"])
    head = ["team", "call [us]", "all signals [us]", "call, `interpreted` [us]"]
    process(FIRST)
    spent = [process(FIRST) for _ in range(PROCESSES)]
    wall, effort = (min(one[what] for one in spent) for what in ("wall", "effort"))
    bare = min(process("import numpy")["wall"] for _ in range(PROCESSES))
    start = (
        f"A new process returns its first command after {wall:.2f} s ({effort:.2f} s of processor time). "
        f"Starting Python and importing NumPy take {bare:.2f} s of the {wall:.2f} s. "
        f"Measured with Python {sys.version.split()[0]}."
    )
    return {"controller": f"{table(head, rows)}\n\n{start}"}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
