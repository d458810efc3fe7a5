"""`python -m benchmarks.robustness`: where each law holds: figure and tables of docs/robustness.md."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from benchmarks.document import DOCS, publish, swept, table, wants_docs
from escort_mj.report.figures.drawing.style import figure

if TYPE_CHECKING:
    import pandas

PAGE = "robustness.md"


class Factor(NamedTuple):
    """One study: its name after `robustness_`, words, unit, and the value that the gains are for."""

    name: str
    words: str
    unit: str
    nominal: float


FACTORS = (
    Factor("mass", "mass", "kg", 1.0),
    Factor("payload", "hidden payload", "kg", 0.06),
    Factor("force_limit", "force limit", "N", 10.0),
    Factor("push", "disturbance", "N", 0.5),
    Factor("noise", "noise", "m, m/s", 0.02),
    Factor("delay", "delay", "s", 0.002),
    Factor("timestep", "timestep", "s", 0.002),
    Factor("count", "robots on one circle", "", 5.0),
    Factor("clutter", "obstacles in clutter", "", 4.0),
)


class Map(NamedTuple):
    """What came of one study: values, laws, runs that passed (laws, values), and why others failed."""

    factor: Factor
    values: list[float]
    laws: list[str]
    passed: np.ndarray
    runs: int
    failures: dict[tuple[int, int], str]


def measured(factor: Factor) -> Map:
    """Counts the runs of a study that pass."""
    runs = swept(f"studies/robustness_{factor.name}")
    key = str(runs.columns[1])
    laws, values = (list(dict.fromkeys(runs[name])) for name in ("case", key))
    passed, why = np.zeros((len(laws), len(values)), dtype=int), {}
    for (law, value), of_cell in runs.groupby(["case", key]):
        at = laws.index(law), values.index(value)
        passed[at] = of_cell["passed"].sum()
        if passed[at] < len(of_cell):
            failed = of_cell[~of_cell["passed"]]
            why[at] = Counter(_reason(row) for _, row in failed.iterrows()).most_common(1)[0][0]
    return Map(factor, [float(value) for value in values], laws, passed, runs["seed"].nunique(), why)


REASONS = {
    "contacts": "contact",
    "settling_time": "does not settle in 25 s",
    "radius_error_mean": "radius error above 5 cm",
    "obstacle_clearance_min": "clearance below 0.2 m",
}


def _reason(run: pandas.Series[Any]) -> str:
    """Why a run failed: the first of what it broke."""
    if run["outcome"] != "completed":
        return str(run["outcome"])
    metric = str(run["failed"]).partition(" ")[0]
    return REASONS.get(metric, metric)


def held(found: Map, law: int) -> tuple[int, int] | None:
    """First and last place of the stretch around the nominal value where every run passes; None: nowhere."""
    whole = found.passed[law] == found.runs
    start = int(np.argmin([abs(np.log((v or 1e-9) / found.factor.nominal)) for v in found.values]))
    if not whole[start]:
        return None
    first = last = start
    while first > 0 and whole[first - 1]:
        first -= 1
    while last + 1 < len(whole) and whole[last + 1]:
        last += 1
    return first, last


def stretches(maps: list[Map]) -> Iterator[list[str]]:
    """One row per law: where every run passes, factor by factor."""
    for law, name in enumerate(maps[0].laws):
        cells = []
        for found in maps:
            ends = held(found, law)
            cells.append(
                "nowhere" if ends is None else f"{found.values[ends[0]]:.3g} to {found.values[ends[1]]:.3g}"
            )
        yield [name, *cells]


def sentences(maps: list[Map]) -> Iterator[str]:
    """One sentence per law: what breaks first, and how."""
    for law, name in enumerate(maps[0].laws):
        parts = []
        for found in maps:
            ends, factor = held(found, law), found.factor
            unit = f" {factor.unit}" if factor.unit else ""
            if ends is None:
                at = int(np.argmin([abs(np.log((v or 1e-9) / factor.nominal)) for v in found.values]))
                parts.append(
                    f"{factor.words} {found.values[at]:.3g}{unit}, nominal ({found.failures[law, at]})"
                )
                continue
            for at in (ends[0] - 1, ends[1] + 1):
                if 0 <= at < len(found.values):
                    parts.append(f"{factor.words} {found.values[at]:.3g}{unit} ({found.failures[law, at]})")
        yield f"- **{name}** fails at: {'; '.join(parts)}." if parts else f"- **{name}** never fails."


def draw(path: Path, maps: list[Map]) -> None:
    """The map: for each factor, law against value, colored by the share of runs that pass."""
    rows = -(-len(maps) // 2)
    with figure(path, 0.5 + 1.75 * rows, "Where each law works: runs that pass all verdicts") as canvas:
        panels = canvas.subplots(rows, 2).ravel()
        for axes, found in zip(panels, maps, strict=False):
            share = found.passed / found.runs
            axes.imshow(share, aspect="auto", cmap="RdYlBu", vmin=0.0, vmax=1.0, alpha=0.5)
            for (law, place), count in np.ndenumerate(found.passed):
                axes.text(place, law, str(count), ha="center", va="center", fontsize=7.0, color="#222222")
            unit = f" [{found.factor.unit}]" if found.factor.unit else ""
            axes.set_title(f"{found.factor.words[0].upper()}{found.factor.words[1:]}{unit}")
            axes.set_xticks(range(len(found.values)), [f"{value:.2g}" for value in found.values])
            axes.set_yticks(range(len(found.laws)), found.laws)
            axes.grid(visible=False)
            axes.tick_params(length=0)
            axes.tick_params(axis="x", labelsize=6.5)
        for axes in panels[len(maps) :]:
            axes.set_axis_off()


def main() -> None:
    """Makes the runs that are missing, and writes figure, tables and sentences into the docs if asked."""
    from scipy.stats import binomtest  # slow to import, and tests import this module

    write = wants_docs(__doc__, PAGE)
    maps = [measured(factor) for factor in FACTORS]
    runs = maps[0].runs
    low = math.floor(100 * binomtest(runs, runs).proportion_ci(0.95, "exact").low)
    high = math.ceil(100 * binomtest(0, runs).proportion_ci(0.95, "exact").high)
    note = (
        f"The numbers in the figure count the passing runs, out of {runs} runs with different seeds. "
        f"By exact binomial intervals (95 %), {runs} of {runs} means that more than {low} % "
        f"of such runs pass, and 0 of {runs} means that fewer than {high} % pass."
    )
    head = ["law", *(f"{f.words}{f' [{f.unit}]' if f.unit else ''}" for f in FACTORS)]
    tables = {
        "note": note,
        "stretches": table(head, stretches(maps)),
        "sentences": "\n".join(sentences(maps)),
    }
    publish(PAGE, tables, write)
    draw(DOCS / "figures" / "robustness.png" if write else Path("renders") / "robustness.png", maps)


if __name__ == "__main__":
    main()
