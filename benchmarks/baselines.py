"""`python -m benchmarks.baselines`: laws and outer loops compared, as the tables of docs/baselines.md."""

from __future__ import annotations

import os
from typing import Any

os.environ.setdefault("MUJOCO_GL", "disable")

import escort_mj  # noqa: E402
from benchmarks.document import publish, wants_docs  # noqa: E402
from escort_mj.report.comparison import comparison, markdown  # noqa: E402
from escort_mj.study.sweeps.results import open_results  # noqa: E402

PAGE, SEEDS = "baselines.md", 3
LOOPS = "nsb,set_based,potential_field,barrier_filter"
MISSIONS = {"main": LOOPS, "main_3d": LOOPS, "paper/case1_2d": "nsb"}


def main(arguments: Any = None) -> None:
    """Compares, or finds the runs of an earlier time; writes the tables into the docs if asked."""
    write, tables = wants_docs(__doc__, PAGE, arguments), {}
    for name, loops in MISSIONS.items():
        found = escort_mj.compare(name, outer=loops, seeds=SEEDS)
        tables[found.name] = "\n".join(markdown(comparison(open_results(found.folder)))).rstrip()
    publish(PAGE, tables, write)


if __name__ == "__main__":
    main()
