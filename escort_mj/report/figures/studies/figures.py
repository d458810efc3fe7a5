"""Figures of a study: heat maps, curves with bands, intervals, and safety against precision and effort."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

from escort_mj.record.folder import FIGURES
from escort_mj.report.figures.drawing.scales import heading
from escort_mj.report.figures.studies import curves, heat_maps, kept, marks, tradeoff
from escort_mj.study.sweeps.quantities import PRECISION, SAFETY
from escort_mj.study.sweeps.results import Factor, Results

MOST_MAPS = 3  # pairs of factors
NO_WORD = re.compile(r"[^A-Za-z0-9_-]+")  # what names of files leave out: LaTeX takes a dot for the suffix
BANDS = "share of runs that pass with its exact 95 % interval, medians with that of the median."
TOGETHER = " Levels of everything else are taken together."
TRADEOFF = (
    "Safety against precision, one mark per cell (medians). Ringed: no other cell is as good in safety, "
    "precision and effort at once. Dashed: the front of safety and precision alone."
)


class Drawn(NamedTuple):
    """A figure that was drawn.

    Attributes:
        path: The file.
        words: What it shows, and how it is to be read.
    """

    path: Path
    words: str


def draw_study(
    results: Results, folder: Path, compare: str | None = None, formats: Sequence[str] = ("svg",)
) -> list[Drawn]:
    """Draw every figure that a study has data for.

    Args:
        results: The study's.
        folder: Where they go, into its `figures/`.
        compare: The factor whose levels are told apart by color; None for what `Results.compared` finds.
        formats: File formats: `svg`, `png`, `pdf`.

    Returns:
        What was drawn, in the first of the formats.

    Raises:
        UsageError: If there is no such factor.
        WriteError: If a file cannot be written.
    """
    by, drawn = results.compared(compare), []
    quantities = results.drawn()
    for suffix in reversed(formats):
        drawn = list(_all(results, folder / FIGURES, suffix, by, quantities))
        for shown in results.figures:
            if not kept.kept_runs(results, shown, folder):
                continue
            path = folder / FIGURES / f"{NO_WORD.sub('_', shown.name)}.{suffix}"
            kept.draw_kept(path, results, shown, folder)
            drawn.append(Drawn(path, shown.title or shown.name))
    return drawn


def _all(
    results: Results, folder: Path, suffix: str, by: Factor | None, quantities: list[str]
) -> list[Drawn]:
    """Every figure in one format."""
    drawn: list[Drawn] = []

    def add(name: str, words: str) -> Path:
        plain = NO_WORD.sub("_", name).strip("_")
        taken = {one.path.stem for one in drawn}
        while plain in taken:  # robots.mass, and a parameter robots_mass
            plain += "_"
        drawn.append(Drawn(folder / f"{plain}.{suffix}", words))
        return drawn[-1].path

    others = [f for f in results.factors.values() if f is not by and len(f.levels) > 1]
    laid_out = [factor for factor in others if not factor.drawn]
    for factor in (f for f in others if f.numbers):
        words = f"Against {factor.name}: {BANDS}" + TOGETHER * (len(others) > 1)
        curves.draw_study_curves(add(f"curves_{factor.name}", words), results, factor, by, quantities)
    pairs = [(x, y, by) for x, y in combinations(laid_out, 2)]
    if not pairs and by is not None and laid_out:
        pairs = [(laid_out[0], by, None)]
    for x, y, panels in pairs[:MOST_MAPS]:
        for quantity in quantities:
            what = heading(results.quantities[quantity])
            words = f"{what} over {x.name} and {y.name}; the brighter the better." + TOGETHER * (
                len(laid_out) > 2
            )
            name = f"map_{quantity}_{x.name}_{y.name}"
            heat_maps.draw_map(add(name, words), results, quantity, x, y, panels)
    named = [f for f in results.factors.values() if len(f.levels) > 1 and not f.numbers]
    if len(named) > 2 and len(named) == len(others) + (by is not None):
        across = max(named, key=lambda factor: len(factor.levels))
        colors, marked = [factor for factor in named if factor is not across][:2]
        words = f"Medians: a column per {across.name}, a color per {colors.name}, a mark per {marked.name}."
        marks.draw_marks(add("cells", words), results, (across, colors, marked), quantities)
    elif not any(factor.numbers for factor in others):
        words = f"Each cell: {BANDS}"
        curves.draw_intervals(add("intervals", words), results, by, quantities)
    if {SAFETY, PRECISION} <= set(quantities):
        tradeoff.draw_tradeoff(add("tradeoff", TRADEOFF), results, by)
    return drawn
