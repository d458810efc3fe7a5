"""`python -m benchmarks.tuning`: the paper's gains tuned, as the tables and the figure of docs/tuning.md."""

from __future__ import annotations

import shutil
from pathlib import Path

from benchmarks.document import DOCS, publish, table, wants_docs
from escort_mj.api import scenarios_folder
from escort_mj.report.figures.studies.tuning import draw_tuning
from escort_mj.study.engine import backends
from escort_mj.study.engine.parallel import cores
from escort_mj.study.search.evaluate import base_of
from escort_mj.study.search.tune import tune_design
from escort_mj.study.search.tuned import rows_of_gains
from escort_mj.study.sweeps.definition import load_study
from escort_mj.study.sweeps.design import Design

PAGE, STUDY = "tuning.md", "tune_apd_smc"


def main() -> None:
    """Tunes, or finds the runs of an earlier time; writes tables and figure into the docs if asked."""
    write = wants_docs(__doc__, PAGE)
    design = Design(load_study(scenarios_folder() / "studies" / f"{STUDY}.yaml"), scenarios_folder())
    out, section = Path("renders") / "studies" / STUDY, design.study.tune
    assert section is not None, "the study tunes"
    with backends.local(cores()) as backend:
        found = tune_design(design, out, backend)
    values = [
        [f"`{key.removeprefix('controller.')}`", f"{base_of(design, key):g}", f"{value:g}"]
        for key, value in found.best.point.items()
    ]
    pairs = max(gain.pairs for gain in found.gains.values())
    gains = table(
        ["metric", "paper's gains", "tuned", "change", "95 % interval", "smaller in"],
        rows_of_gains(found, section),
    )
    feasible = sum(trial.feasible for trial in found.trials)
    effort = (
        f"{len(found.trials)} trials with {len(design.seeds)} seeds each ({feasible} trials are within "
        f"the bounds); {pairs} held-out seeds. Held-out runs that failed a verdict: {found.failed[0]} with "
        f"the paper's gains, {found.failed[1]} with the tuned gains."
    )
    tables = {"values": table(["gain", "paper", "tuned"], values), "gains": gains, "effort": effort}
    pictures = draw_tuning(out, section, found)
    publish(PAGE, tables, write)
    if write:
        shutil.copy(pictures[0], DOCS / "figures" / "tuning.png")


if __name__ == "__main__":
    main()
