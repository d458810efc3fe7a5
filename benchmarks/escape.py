"""`python -m benchmarks.escape`: how often a target with a will gets out of its team, for docs/pursuit.md."""

from __future__ import annotations

import math
from itertools import product
from typing import TYPE_CHECKING, Any

from benchmarks.document import measure_page, swept, table
from escort_mj.study.sweeps.statistics import proportion_of

if TYPE_CHECKING:
    import pandas

PAGE = "pursuit.md"
SCENARIOS = {"voronoi": "pursuit/evader", "burst": "pursuit/burst"}
COUNTS = (5, 6, 8)
SHARE = 0.8  # of the speed ratio up to which even points on a circle stop straight dashes
FREE, END = 10.0, 20.0  # when the target begins to run, and the end [s]
SEEDS = range(1, 101)
RADIO: dict[str, Any] = {
    "knowledge": {
        "target": {"robots": [1, 3], "rate": 50.0, "noise": {"position": 0.01, "velocity": 0.01}},
        "estimator": {"estimator": "kalman", "model": "velocity", "noise": 1.0},
        "initial": {"position": 0.3},
    },
    "communication": {"graph": "ring", "rate": 10.0, "delay": 0.1, "loss": 0.2},
}
SEEN: dict[str, dict[str, Any]] = {"all robots see it": {}, "two see it, radio": RADIO}
HEAD = ["robots", "speed ratio", "policy", *(f"{seen} [%]" for seen in SEEN)]


def ratio(count: int) -> float:
    """Speed of the target / of the robots."""
    return SHARE / math.sin(math.pi / count)


def study() -> dict[str, Any]:
    """So many robots against each policy, by what robots see of the target."""
    return {
        "study": "escape",
        "cases": {policy: {"scenario": name} for policy, name in SCENARIOS.items()},
        "set": {
            "duration": END,
            "recording.rate": 50.0,
            "expect": [{"metric": "hull_margin", "at_least": 0.0, "after": FREE}],
        },
        "vary": {
            "robots": {str(n): {"robots.count": n, "target.policy.speed": ratio(n)} for n in COUNTS},
            "seen": SEEN,
        },
        "first_seed": SEEDS[0],
        "seeds": len(SEEDS),
    }


def share(runs: pandas.DataFrame) -> str:
    """In how many of the runs the target stays in the hull [%], and Wilson's 95 % interval."""
    stayed = proportion_of(runs["passed"], method="wilson")
    low, high = (100.0 * bound for bound in stayed.interval)
    return f"{100.0 * stayed.share:.0f} ({low:.0f} to {high:.0f})"


def tables() -> dict[str, str]:
    """Makes the runs that are missing, prints the table, and writes it into the docs if asked."""
    runs = swept(study())
    rows = []
    for count, policy in product(COUNTS, SCENARIOS):
        some = runs[(runs["robots"] == count) & (runs["case"] == policy)]
        shares = (share(some[some["seen"] == seen]) for seen in SEEN)
        rows.append([str(count), f"{ratio(count):.2f}", policy, *shares])
    return {"escape": table(HEAD, rows)}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
