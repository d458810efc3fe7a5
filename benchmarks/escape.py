"""`python -m benchmarks.escape`: how often a target with a will gets out of its team, for docs/pursuit.md."""

from __future__ import annotations

import math
from typing import Any

import escort_mj
from benchmarks.document import measure_page, table
from escort_mj.study.sweeps.statistics import proportion_of

PAGE = "pursuit.md"
SCENARIOS = {"voronoi": "pursuit/evader", "burst": "pursuit/burst"}
COUNTS = (5, 6, 8)
SHARE = 0.8  # of the speed ratio up to which even points on a circle stop straight dashes
FREE, END = 10.0, 20.0  # when the target begins to run, and the end [s]
SEEDS = range(1, 101)
SEEN = {"all robots see it": None, "two see it, radio": [1, 3]}
HEAD = ["robots", "speed ratio", "policy", *(f"{seen} [%]" for seen in SEEN)]
RADIO: dict[str, Any] = {
    "knowledge": {
        "target": {"rate": 50.0, "noise": {"position": 0.01, "velocity": 0.01}},
        "estimator": {"estimator": "kalman", "model": "velocity", "noise": 1.0},
        "initial": {"position": 0.3},
    },
    "communication": {"graph": "ring", "rate": 10.0, "delay": 0.1, "loss": 0.2},
}


def chase(policy: str, count: int, seen: str) -> escort_mj.Scenario:
    """Return the mission of so many robots against this policy, and of what robots see of the target."""
    keys: dict[str, Any] = {
        "duration": END,
        "recording.rate": 50.0,
        "robots.count": count,
        "target.policy.speed": SHARE / math.sin(math.pi / count),
        "expect": [{"metric": "hull_margin", "at_least": 0.0, "after": FREE}],
    }
    if SEEN[seen] is not None:
        keys |= {**RADIO, "knowledge.target.robots": SEEN[seen]}
    return escort_mj.load_scenario(SCENARIOS[policy]).replace(keys)


def share(base: escort_mj.Scenario) -> str:
    """Return in how many of the runs the target stays in the hull [%], and Wilson's 95 % interval."""
    runs = list(escort_mj.run_many((base.replace({"seed": seed}) for seed in SEEDS), threads=1))
    for run in runs:
        if not run.outcome.good:
            print(run, flush=True)
    stayed = proportion_of([run.passed for run in runs], method="wilson")
    low, high = (100.0 * bound for bound in stayed.interval)
    return f"{100.0 * stayed.share:.0f} ({low:.0f} to {high:.0f})"


def tables() -> dict[str, str]:
    """Makes all runs, prints the table, and writes it into the docs if asked."""
    rows = []
    for count in COUNTS:
        for policy in SCENARIOS:
            rows.append([str(count), f"{SHARE / math.sin(math.pi / count):.2f}", policy])
            for seen in SEEN:
                rows[-1].append(share(chase(policy, count, seen)))
                print(rows[-1], flush=True)
    return {"escape": table(HEAD, rows)}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
