"""`python -m benchmarks.baselines`: laws and outer loops compared, as the tables of docs/baselines.md."""

from __future__ import annotations

import escort_mj
from benchmarks.document import measure_page
from escort_mj.report.comparison import comparison, markdown
from escort_mj.study.sweeps.results import open_results

PAGE, SEEDS = "baselines.md", 3
LOOPS = "nsb,set_based,potential_field,barrier_filter"
MISSIONS = {"main": LOOPS, "main_3d": LOOPS, "paper/case1_2d": "nsb"}


def tables() -> dict[str, str]:
    """Compares, or finds the runs of an earlier time; writes the tables into the docs if asked."""
    tables = {}
    for name, loops in MISSIONS.items():
        found = escort_mj.compare(name, outer=loops, seeds=SEEDS)
        tables[found.name] = "\n".join(markdown(comparison(open_results(found.folder)))).rstrip()
    return tables


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
