"""A study's design and what came of its runs, side by side: what reports and statistics look at."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, field_serializer

from escort_mj.errors import RunFolderError, UsageError
from escort_mj.files import checked, read_json, write_text
from escort_mj.metrics import METRICS
from escort_mj.scenario.findings import parse_key_path
from escort_mj.scenario.reader.dump import flow
from escort_mj.scenario.reader.files.paths import locate
from escort_mj.study.engine.store import Row, open_store
from escort_mj.study.sweeps.definition import CellsExpectation, KeptFigure, draws_of
from escort_mj.study.sweeps.design import CASE, SAMPLE, Cell, Clock, Design, Planned, word
from escort_mj.study.sweeps.quantities import (
    COMPLETED,
    EFFORT,
    PASSED,
    PRECISION,
    RATES,
    SAFETY,
    VALUES,
    Quantity,
    quantity_of,
    quantity_of_metric,
)
from escort_mj.study.sweeps.statistics import (
    LEVEL,
    Paired,
    Proportion,
    Summary,
    holm,
    paired,
    pareto,
    proportion_of,
)
from escort_mj.study.sweeps.values import Range, Steps

Array = NDArray[np.float64]

FILE = "design.json"
WIDE = (
    4.0  # numbers whose largest is so many times the least are shown on a logarithmic scale, if they fit one
)
LAWS = ("controller", "controller.law")
SHOWN = (PRECISION, "settling_time", SAFETY, EFFORT, "force_rms", "chattering")
DRAWN = (PRECISION, SAFETY, EFFORT)
LARGEST = 1e150  # number of a study: squares of larger ones are infinite


class Factor(NamedTuple):
    """One thing that a study varies.

    Attributes:
        name: A scenario key, or `case`.
        levels: Its levels in words, in the order of the study, numbers in rising order.
        numbers: The levels as numbers; empty where they are none.
        log: Whether a logarithmic scale suits the numbers.
        drawn: Whether its values were drawn from a range: nearly every cell has one of its own.
        unit: SI unit of the numbers; empty for none or unknown.
    """

    name: str
    levels: tuple[str, ...]
    numbers: tuple[float, ...]
    log: bool
    drawn: bool
    unit: str

    @property
    def title(self) -> str:
        """Name with unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


class Varied(NamedTuple):
    """A factor as the design knows it: see `Factor`."""

    name: str
    log: bool = False
    drawn: bool = False


class DesignRecord(BaseModel, strict=True):
    """What a report has to know of a design; the attributes are those of `Results`."""

    study: str
    description: str = ""
    texts: Annotated[dict[str, str], Field(min_length=1)]
    factors: list[Varied]
    cells: Annotated[list[Cell], Field(min_length=1)]
    runs: list[Planned]
    metrics: dict[str, Quantity] = {}
    """Those of plugins, and over windows that the study asks for."""
    expect: Annotated[list[CellsExpectation], Field(strict=False)] = []
    apart: str = ""
    figures: Annotated[list[KeptFigure], Field(strict=False)] = []
    chosen: list[str] = []
    clocks: list[Clock] = []

    def write(self, folder: Path) -> None:
        """Write them beside the results that they are of: keys change with versions, this file does not."""
        write_text(folder / FILE, json.dumps(self.model_dump()) + "\n")

    @field_serializer("factors", "cells")
    def _named(self, tuples: list[Any]) -> list[dict[str, Any]]:
        return [one._asdict() for one in tuples]

    @field_serializer("metrics")
    def _described(self, metrics: dict[str, Quantity]) -> dict[str, Any]:
        return {name: one._asdict() for name, one in metrics.items()}


class Comparison(NamedTuple):
    """One level of a factor against the first, in one quantity.

    Attributes:
        quantity: Which.
        first: The level that the other is held against.
        level: The other level.
        paired: The comparison; differences are level minus first.
        p: Its Wilcoxon p, adjusted for all comparisons that are made together (Holm).
        better: The level that is better, as far as the test can tell: p is below 1 - `LEVEL`, and the
            dominance is on the same side; empty where it cannot.
    """

    quantity: str
    first: str
    level: str
    paired: Paired
    p: float
    better: str


class Results:
    """What a study asked for and what came of it.

    Attributes:
        name: The study's.
        description: What it is to find out.
        scenario: The scenarios that it varies, as the study names them.
        texts: Their YAML.
        expect: What it expects of its cells.
        apart: The factor whose levels are judged each by itself; empty for none.
        figures: Which kept runs it shows side by side.
        cells: All cells.
        runs: All runs that the study asks for.
        rows: What came of them, by key; runs that have not been made are not there.
        cell: Each run's cell, shape (runs,).
        levels: Each run's level of each factor, an index into the factor's levels, shape (runs,).
        level_of_cell: Each cell's level of each factor, shape (cells,).
        factors: What is varied.
        metrics: What a run has a value of, by name: shipped metrics, those of plugins, and metrics over
            windows that the study asks for.
        chosen: What the study asks tables and figures to show; empty for the usual.
        clocks: How often the runs of each cell are looked at.
        quantities: Metrics and rates, by name.
    """

    def __init__(self, facts: DesignRecord, rows: Mapping[str, Row]) -> None:
        """Compare them side by side.

        Args:
            facts: Of the design.
            rows: By key.
        """
        self.name, self.description, self.texts = facts.study, facts.description, facts.texts
        self.scenario = ", ".join(self.texts)
        first = next(iter(self.texts))
        self.cells = tuple(cell._replace(scenario=cell.scenario or first) for cell in facts.cells)
        self.expect, self.figures, self.apart = facts.expect, facts.figures, facts.apart
        self.runs, self.chosen, self.clocks = tuple(facts.runs), facts.chosen, facts.clocks
        self.rows = {run.key: rows[run.key] for run in self.runs if run.key in rows}
        self.cell = np.array([run.cell for run in self.runs], dtype=np.intp)
        own = {
            name: one._replace(title=one.title or name.replace("_", " "))
            for name, one in facts.metrics.items()
        }
        self.metrics: dict[str, Quantity] = VALUES | own
        self.quantities = RATES | self.metrics
        self.levels: dict[str, NDArray[np.intp]] = {}
        self.level_of_cell: dict[str, NDArray[np.intp]] = {}
        self._values: dict[str, Array] = {}
        self._summaries: dict[tuple[str, int], Summary] = {}
        self.factors = {one.name: self._factor(*one) for one in facts.factors}

    def _factor(self, name: str, log: bool, drawn: bool) -> Factor:
        plain = list({json.dumps(cell.labels[name]): cell.labels[name] for cell in self.cells}.values())
        if all(isinstance(value, int | float) and not isinstance(value, bool) for value in plain):
            plain.sort()
            numbers = tuple(float(value) for value in plain)
            words, log, unit = list(map(word, plain)), log or spreads_by_factors(numbers), unit_of(name)
        else:
            words, numbers, log, unit = list(map(word, plain)), (), False, ""
            words = [w if words.count(w) == 1 else flow(v) for w, v in zip(words, plain, strict=True)]
        place = {json.dumps(value): index for index, value in enumerate(plain)}
        of_cell = np.array([place[json.dumps(cell.labels[name])] for cell in self.cells], dtype=np.intp)
        self.level_of_cell[name], self.levels[name] = of_cell, of_cell[self.cell]
        return Factor(name, tuple(words), numbers, log, drawn, unit)

    def values(self, quantity: str) -> Array:
        """A quantity of each run, infinite for never, NaN for missing; shape (runs,)."""
        if quantity not in self._values:
            rows = [self.rows.get(run.key) for run in self.runs]
            found = [math.nan if row is None else quantity_of(row, quantity) for row in rows]
            self._values[quantity] = np.array(found, dtype=np.float64)
        return self._values[quantity]

    def of_cell(self, quantity: str, index: int) -> Array:
        """A quantity of the runs of one cell."""
        return self.values(quantity)[self.cell == index]

    def rows_of(self, index: int) -> list[Row | None]:
        """What came of the runs of one cell, seed by seed; None for those that have not been made."""
        return [self.rows.get(run.key) for run in self.runs if run.cell == index]

    @property
    def block(self) -> str:
        """What pairs of runs are independent by: seeds, or the points that were drawn."""
        return "point" if any(SAMPLE in cell.labels for cell in self.cells) else "seed"

    def title(self, index: int) -> str:
        """A cell in words: what it sets each factor to."""
        return ", ".join(
            level if name == CASE else f"{name} = {level}" for name, level in self.labels(index).items()
        )

    def labels(self, index: int) -> dict[str, str]:
        """A cell's level of each factor, in words."""
        return {name: factor.levels[self.level_of_cell[name][index]] for name, factor in self.factors.items()}

    def rate(self, quantity: str, index: int) -> Proportion:
        """How often something happened in a cell: `passed`, `completed` or `collided`."""
        return proportion_of(self.of_cell(quantity, index))

    def failed(self, index: int) -> Counter[str]:
        """Expectations that failed in a cell, and in how many of its runs."""
        return Counter(words for row in self.rows_of(index) if row is not None for words in row.failed)

    def summary(self, quantity: str, index: int) -> Summary:
        """What the runs of a cell say of a quantity."""
        if (quantity, index) not in self._summaries:
            self._summaries[quantity, index] = Summary(self.of_cell(quantity, index))
        return self._summaries[quantity, index]

    def known(self, quantities: Iterable[str]) -> list[str]:
        """Those quantities of which at least one run has a value."""
        return [name for name in quantities if not np.isnan(self.values(name)).all()]

    def shown(self) -> list[str]:
        """Metrics of tables: those that the study chose, else the usual and what its verdicts look at."""
        judged = [v.metric for row in self.rows.values() for v in row.verdicts]
        usual = [name for name in dict.fromkeys([*SHOWN, *judged]) if name in self.metrics]
        return self.known(self.chosen or usual)

    def drawn(self) -> list[str]:
        """Quantities of figures: the share that passes, and what the study chose, else the usual."""
        return self.known([PASSED, *(self.chosen or DRAWN)])

    def medians(self, quantity: str) -> Array:
        """Median of each cell, shape (cells,); NaN where no run has a value."""
        return np.array([self.summary(quantity, index).median for index in range(len(self.cells))])

    def front(self) -> NDArray[np.bool_]:
        """Cells whose medians no other cell beats in safety, precision and effort at once; shape (cells,)."""
        kept = self.known([SAFETY, PRECISION, EFFORT])
        if not kept:
            return np.zeros(len(self.cells), dtype=bool)
        costs = [self.quantities[name].cost_sign * self.medians(name) for name in kept]
        return pareto(np.stack(costs, axis=1))

    def compared(self, name: str | None = None) -> Factor | None:
        """The factor whose levels are compared: the one named, else laws, cases, or one without numbers.

        Raises:
            UsageError: If the study has no such factor, or its values were drawn.
        """
        able = {key: factor for key, factor in self.factors.items() if not factor.drawn}
        if name is not None:
            if name not in able:
                raise UsageError(
                    f"found {name}; this study compares levels of {', '.join(able) or 'nothing'}"
                )
            return able[name]
        wordy = [key for key, factor in able.items() if not factor.numbers and len(factor.levels) > 1]
        first = next((key for key in (*LAWS, CASE, *wordy) if key in wordy), None)
        return None if first is None else able[first]

    def best(self, quantity: str) -> int | None:
        """The cell with the best mean of a quantity; None without any.

        Only those count of which every run completed, and the best never says never.
        """
        sign = self.quantities[quantity].cost_sign
        found = [self.summary(quantity, index) for index in range(len(self.cells))]
        able = [
            (sign * one.mean, index)
            for index, one in enumerate(found)
            if self.completed(index) and one.known and not one.never
        ]
        return min(able)[1] if able else None

    def told_best(self, quantities: Iterable[str]) -> dict[str, tuple[int, float]]:
        """Cells that are better than each other one in a quantity, as far as tests can tell.

        The one with the best mean is held against each other of which every run completed, seed by seed, by
        Wilcoxon's signed-rank test. The largest p, times the number of others (Bonferroni), is that of being
        the best; those of all quantities are corrected together (Holm). Moments that differ by no more than
        runs are looked at are alike.

        Returns:
            By quantity, the cell and its corrected p, where that is below 1 - `LEVEL`.
        """
        firsts = {name: index for name in quantities if (index := self.best(name)) is not None}
        corrected = holm([self._chance(name, index) for name, index in firsts.items()])
        told = zip(firsts.items(), corrected, strict=True)
        return {name: (index, p) for (name, index), p in told if p < 1.0 - LEVEL}

    def completed(self, index: int) -> bool:
        """Whether every run of a cell completed."""
        return bool((self.of_cell(COMPLETED, index) == 1.0).all())

    def _chance(self, quantity: str, first: int) -> float:
        """Probability of a cell to look better than each other one by chance; NaN without others."""
        values, fine = self.of_cell(quantity, first), self.resolution(quantity)
        found = []
        for index in range(len(self.cells)):
            if index != first and self.completed(index) and self.summary(quantity, index).known:
                resolution = np.maximum(fine[self.cell == first], fine[self.cell == index])
                found.append(paired(values, self.of_cell(quantity, index), resolution=resolution))
        if all(one.alike == one.pairs for one in found):
            return math.nan
        sign = self.quantities[quantity].cost_sign
        worst = max(one.p if sign * one.side > 0 and sign * one.dominance > 0.0 else 1.0 for one in found)
        return min(1.0, worst * len(found))

    def comparisons(self, factor: Factor, quantities: Iterable[str]) -> Iterator[Comparison]:
        """Each level of a factor against its first, over the same seeds and the same levels of all else.

        Seeds are the independent blocks; where the study draws points, these are. What is compared in one
        call is corrected together; a comparison in which all pairs are alike can find nothing by chance, and
        does not count.
        """
        pairs, found = self._pairs(factor), []
        for name in quantities:
            values, fine = self.values(name), self.resolution(name)
            for level in range(1, len(factor.levels)):
                some = [(at[0], at[level], block) for at, block in pairs if 0 in at and level in at]
                first, second = ([one[side] for one in some] for side in (0, 1))
                resolution = np.maximum(fine[first], fine[second])
                blocks = [one[2] for one in some]
                found.append((name, level, paired(values[first], values[second], blocks, resolution)))
        adjusted = holm([math.nan if one.alike == one.pairs else one.p for *_, one in found])
        for (name, level, one), p in zip(found, adjusted, strict=True):
            p = one.p if math.isnan(p) else p
            sides = {-1: factor.levels[0], 1: factor.levels[level]}
            sign = 1 if self.quantities[name].more_is_better else -1
            told = p < 1.0 - LEVEL and one.side * one.dominance > 0.0
            better = sides[sign * one.side] if told else ""
            yield Comparison(name, factor.levels[0], factor.levels[level], one, p, better)

    def resolution(self, quantity: str) -> Array:
        """How exactly a quantity of each run is known, shape (runs,): moments to the sample or step [s]."""
        of = self.quantities[quantity]
        if not of.moment or not self.clocks:
            return np.zeros(len(self.runs))
        fine = [clock.timestep if of.exact else clock.interval for clock in self.clocks]
        return np.array(fine)[self.cell]

    def _pairs(self, factor: Factor) -> list[tuple[dict[int, int], Any]]:
        """Runs that differ in the level of this factor alone: run by level, and the block they belong to."""
        groups: dict[tuple[Any, ...], tuple[dict[int, int], Any]] = {}
        others = [levels for name, levels in self.levels.items() if name != factor.name]
        for index, run in enumerate(self.runs):
            block = self.cells[run.cell].labels.get(SAMPLE, run.seed)
            same = block, run.seed, *(int(levels[index]) for levels in others)
            groups.setdefault(same, ({}, block))[0][int(self.levels[factor.name][index])] = index
        return list(groups.values())


def unit_of(key: str) -> str:
    """SI unit of a scenario key, as its documentation has it; empty for none."""
    found = re.search(r"\[([^\]]+)\]", locate(parse_key_path(key) or ()).meaning)
    units = found[1].split(" or ") if found else [""]  # of positions, or of velocities
    return units[-1 if "velocity" in key else 0]


def spreads_by_factors(numbers: Sequence[float]) -> bool:
    """Whether rising numbers lie more evenly on a logarithmic scale, and far enough apart for one."""
    if len(numbers) < 3 or numbers[0] <= 0.0 or numbers[-1] < WIDE * numbers[0]:
        return False
    steps = [np.diff(scale) for scale in (np.array(numbers), np.log(numbers))]
    linear, log = (float(step.std() / step.mean()) for step in steps)
    return log < linear


def record_of(design: Design) -> DesignRecord:
    """What a report has to know of a design, as JSON can hold it."""
    study = design.study
    log = {key for key, value in study.vary.items() if isinstance(value, Steps) and value.scale == "log"}
    drawn = {key: draw for key, draw in draws_of(study).items() if isinstance(draw, Range)}
    log |= {key for key, draw in drawn.items() if draw.scale == "log"}
    return DesignRecord(
        study=study.study,
        description=study.description,
        texts={name: template.text for name, template in design.templates.items()},
        expect=[*study.expect],
        apart=study.apart,
        figures=[*study.figures],
        factors=[Varied(name, name in log, name in drawn) for name in design.factors],
        cells=json.loads(json.dumps([cell._asdict() for cell in design.cells], default=str)),
        runs=[*design.runs()],
        metrics=_own_quantities(design),
        chosen=[one.key for one in study.quantities],
        clocks=[design.clock(cell) for cell in design.cells],
    )


def _own_quantities(design: Design) -> dict[str, Quantity]:
    """Metrics of plugins, and metrics over windows that the study asks for."""
    own = {metric.name: metric for metric in design.own_metrics()}
    known = own | {metric.name: metric for metric in METRICS}
    windows = {key: quantity_of_metric(known[name], span) for key, name, span in design.measured()}
    return {name: quantity_of_metric(metric) for name, metric in own.items()} | windows


def open_results(folder: Path) -> Results:
    """The results in a folder of a sweep.

    Raises:
        UsageError: If it has none.
        RunFolderError: If they are damaged.
    """
    with open_store(folder) as store:
        if not (folder / FILE).is_file():
            raise UsageError(
                f"{folder}: holds no design ({FILE}): sweeps and comparisons write one, searches do not"
            )
        facts = _checked(read_json(folder / FILE), folder / FILE)
        return Results(facts, store.get(run.key for run in facts.runs))


def _checked(found: Any, path: Path) -> DesignRecord:
    """Return the facts of a design, if they are such.

    Raises:
        RunFolderError: If they are not.
    """
    facts: DesignRecord = checked(DesignRecord, found, path)
    known = VALUES.keys() | facts.metrics.keys()
    damage = [
        f"chosen names {name!r}, which is no metric of it" for name in facts.chosen if name not in known
    ]
    damage += [
        f"runs[{place}] names no cell of it"
        for place, run in enumerate(facts.runs)
        if not 0 <= run.cell < len(facts.cells)
    ]
    times = [time for clock in facts.clocks for time in clock]
    if len(facts.clocks) not in (0, len(facts.cells)) or not all(0.0 < time < LARGEST for time in times):
        damage.append("clocks are not two times for each cell")
    for place, cell in enumerate(facts.cells):
        labels = f"cells[{place}].labels"
        lacking = [one.name for one in facts.factors if one.name not in cell.labels]
        damage += [f"{labels} has no {name}" for name in lacking]
        for name, value in cell.labels.items():
            if isinstance(value, int | float) and not abs(value) < LARGEST:
                damage.append(f"{labels}.{name} is no number of a study")
    if damage:
        raise RunFolderError(f"{path}: is damaged: {damage[0]}")
    return facts
