"""`python -m benchmarks.gains`: the paper's gains and `gains: auto`, as the table of docs/gains.md."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

os.environ.setdefault("MUJOCO_GL", "disable")

from benchmarks.document import publish, table, wants_docs  # noqa: E402
from escort_mj.api import load_scenario, run_many  # noqa: E402
from escort_mj.measuring import measure_over
from escort_mj.record.window import Span

PAGE, SEEDS = "gains.md", 5
ROBOTS = {
    "point mass": ("main", {}),
    "point mass, motor lag 0.05 s": ("main", {"robots.actuators.lag": 0.05}),
    "rolling sphere": ("main", {"robots.kind": "rolling_sphere"}),
    "slung payload": ("robots/slung", {}),
    "quadrotor": ("robots/quadrotor", {}),
}
LAWS = ("apd_smc", "pd_smc", "asmc")
METRICS = {
    "radius_error_mean": ("radius error [mm]", 1e3),
    "tracking_error_rms": ("tracking error [mm]", 1e3),
    "chattering": ("chattering [N/s]", 1.0),
    "saturated_share": ("saturated [%]", 100.0),
}


def main(arguments: Any = None) -> None:
    """Fly the missions with both; write the table into the docs if asked."""
    write = wants_docs(__doc__, PAGE, arguments)
    rows = []
    for robot, (name, changes) in ROBOTS.items():
        for law in LAWS:
            found = []
            for controller in ({"law": law}, {"law": law, "gains": "auto"}):
                sets = [{**changes, "controller": controller, "expect": [], "seed": k} for k in range(SEEDS)]
                runs = run_many(load_scenario(name, one) for one in sets)
                values = [
                    run.values
                    | {"chattering": measure_over("chattering", run.trace, Span("tail")).value or 0.0}
                    for run in runs
                ]
                found.append({metric: np.mean([one[metric] for one in values]) for metric in METRICS})
            cells = [
                " / ".join(f"{scale * one[key]:.3g}" for one in found) for key, (_, scale) in METRICS.items()
            ]
            rows.append([robot, f"`{law}`", *cells])
            print(rows[-1], flush=True)
    heads = ["robots", "law", *(f"{words}: paper / auto" for words, _ in METRICS.values())]
    publish(PAGE, {"gains": table(heads, rows)}, write)


if __name__ == "__main__":
    main()
