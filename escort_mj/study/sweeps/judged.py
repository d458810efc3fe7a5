"""What a study expects of its cells, judged: each claim, in each level of the factor that is judged apart."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path
from typing import NamedTuple

from escort_mj.files import write_json, write_text
from escort_mj.record.tables import markdown
from escort_mj.record.window import WORDS
from escort_mj.study.sweeps.definition import Better, CellBound, CellsExpectation
from escort_mj.study.sweeps.design import cells_where
from escort_mj.study.sweeps.quantities import COMPLETED, Quantity, value_text
from escort_mj.study.sweeps.results import Results

ALIKE = 0.05  # share by which values must differ to count as worse
MOST_NAMED = 3  # cells
NOTHING = "says nothing of it"  # a level that a claim does not concern
SHORT = {True: "yes", False: "no", None: "-"}
FILES = JSON, MARKDOWN = "expect.json", "expect.md"


class Answer(NamedTuple):
    """Whether a claim holds.

    Attributes:
        holds: Whether it does; None where no cell is concerned, or a run is missing.
        measured: The values that decide it, in words.
    """

    holds: bool | None
    measured: str


class Judged(NamedTuple):
    """A claim and what came of it.

    Attributes:
        claim: What is claimed.
        source: Who says so.
        rule: When it holds, in words.
        answers: By level of the factor that is judged apart; by an empty text where there is none.
    """

    claim: str
    source: str
    rule: str
    answers: dict[str, Answer]

    @property
    def holds(self) -> str:
        """`yes`, `no`, `not in` or `only in` some levels, or `undecided`."""
        decided = {level: answer.holds for level, answer in self.answers.items() if answer.holds is not None}
        holding = [level for level, holds in decided.items() if holds]
        failing = [level for level, holds in decided.items() if not holds]
        waits = [each for each in self.answers.values() if each.holds is None and each.measured != NOTHING]
        if not decided or (waits and not failing):
            return "undecided"
        if not failing or not holding:
            return "no" if failing else "yes"
        few = len(holding) < len(failing)
        return ("only in: " if few else "not in: ") + "; ".join(holding if few else failing)


def judge_cells(results: Results) -> list[Judged]:
    """Judge every claim of a study."""
    levels = results.factors[results.apart].levels if results.apart else ("",)
    return [
        Judged(one.claim, one.source, _rule(results, one), {at: _answer(results, one, at) for at in levels})
        for one in results.expect
    ]


def write_judged(results: Results, folder: Path) -> list[Judged]:
    """Judge every claim of a study, and write what came of them: for programs, and as a table."""
    found = judge_cells(results)
    claims = [
        {"claim": one.claim, "source": one.source, "rule": one.rule, "holds": one.holds}
        | {"answers": {level: answer._asdict() for level, answer in one.answers.items()}}
        for one in found
    ]
    write_json(folder / JSON, {"study": results.name, "apart": results.apart, "claims": claims})
    write_text(folder / MARKDOWN, "\n".join(markdown(*rows_of(found))) + "\n")
    return found


def rows_of(found: Sequence[Judged]) -> tuple[list[str], list[list[str]]]:
    """Head and rows of a table of claims."""
    levels = [level or "measured" for level in found[0].answers] if found else []
    rows = []
    for one in found:
        answers = [f"{SHORT[each.holds]}: {each.measured}" for each in one.answers.values()]
        rows.append([one.claim, one.source, f"**{one.holds}**", one.rule, *answers])
    return ["claim", "source", "holds", "rule", *levels], rows


def judged_lines(found: Sequence[Judged]) -> list[str]:
    """What is to be said of claims, a line each, for a terminal."""
    return [f"  {one.holds:9} {one.source + ': ' if one.source else ''}{one.claim}" for one in found]


def _rule(results: Results, one: CellsExpectation) -> str:
    """When a claim holds, in words."""
    rules = [_bound_words(results, bound) for bound in one.bounds]
    if one.better is not None:
        other = ", ".join(map(str, one.better.than.values()))
        names = " or ".join(_title(results.quantities[each.key]) for each in one.better.quantities)
        than = f"{100 * one.better.by:g} % than with {other}, none worse by {100 * ALIKE:g} %"
        rules.append(f"{names} better by {than}")
    return "; ".join(rules) or "every run completes"


def _bound_words(results: Results, bound: CellBound) -> str:
    quantity = results.quantities[bound.key]
    sides = [
        f"{words} {value_text(limit, quantity.unit)}"
        for words, limit in (("at most", bound.at_most), ("at least", bound.at_least))
        if limit is not None
    ]
    return f"{_title(quantity)} {' and '.join(sides)}"


def _title(quantity: Quantity) -> str:
    """A quantity, and the part of the run that it looks at unless that is all of it."""
    return quantity.title + (f" ({quantity.window})" if quantity.window not in ("", WORDS["whole"]) else "")


def _answer(results: Results, one: CellsExpectation, level: str) -> Answer:
    """Whether a claim holds in one level."""
    cells = cells_where(results.cells, one.where)
    if results.apart:
        cells = [index for index in cells if results.labels(index)[results.apart] == level]
    if not cells:
        return Answer(None, NOTHING)
    others = [] if one.better is None else [_other(results, index, one.better) for index in cells]
    if missing := [index for index in (*cells, *others) if not _known(results, index)]:
        return Answer(None, f"{_named(results, missing, (*cells, *others))} has not run")
    found = [_of_cell(results, one, index, other) for index, other in zip_longest(cells, others)]
    good = [index for index, answer in zip(cells, found, strict=True) if answer.holds]
    if len(cells) == 1:
        return found[0]
    words = f"in {len(good)} of {len(cells)} cells"
    if one.better is not None:
        pairs, by = list(zip(cells, others, strict=True)), one.better.by
        counts = [
            f"{results.quantities[name].title} in {sum(_wins(results, *pair, name, by) for pair in pairs)}"
            for name in (each.key for each in one.better.quantities)
        ]
        words += f"; better by {', '.join(counts)}"
    bad = [index for index in cells if index not in good]
    return Answer(not bad, words + (f"; not in {_named(results, bad, cells)}" if bad else ""))


def _of_cell(results: Results, one: CellsExpectation, index: int, other: int | None) -> Answer:
    """Whether a claim holds in one cell."""
    if not results.completed(index):
        both = [index] if other is None else [index, other]
        return Answer(False, "; ".join(filter(None, (_ended(results, at) for at in both))))
    holds, words = True, []
    for bound in one.bounds:
        value = _value(results, bound.key, index)
        low = -math.inf if bound.at_least is None else bound.at_least
        holds &= low <= value <= (math.inf if bound.at_most is None else bound.at_most)
        quantity = results.quantities[bound.key]
        words.append(f"{quantity.title} {value_text(value, quantity.unit)}")
    if one.better is not None and other is not None:
        holds &= _better(results, index, other, one.better)
        words.append(_pairs(results, index, other, one.better))
    return Answer(holds, "; ".join(words) or "completed")


def _better(results: Results, index: int, other: int, better: Better) -> bool:
    """Whether a cell is better than another: in one quantity at least, and in none worse.

    A cell with runs that did not complete is never better, and any that completed is better than it.
    """
    if not results.completed(other):
        return True
    names = [each.key for each in better.quantities]
    ahead = any(_wins(results, index, other, name, better.by) for name in names)
    return ahead and not any(_wins(results, other, index, name, ALIKE) for name in names)


def _wins(results: Results, index: int, other: int, name: str, by: float) -> bool:
    """Whether a cell's median is better than another's by a share."""
    if not results.completed(index) or not results.completed(other):
        return results.completed(index)
    ours, theirs = _value(results, name, index), _value(results, name, other)
    more = results.quantities[name].more_is_better
    high, low = (ours, theirs) if more else (theirs, ours)
    return low < high * (1.0 - math.copysign(by, high))


def _pairs(results: Results, index: int, other: int, better: Better) -> str:
    """Medians of both cells side by side, or how the other one ended."""
    if not results.completed(other):
        return _ended(results, other)
    both = []
    for each in better.quantities:
        unit = results.quantities[each.key].unit
        both.append(" / ".join(value_text(_value(results, each.key, at), unit) for at in (index, other)))
    return ", ".join(both)


def _other(results: Results, index: int, better: Better) -> int:
    """The cell with which a cell is compared."""
    labels = results.cells[index].labels | better.than
    return cells_where(results.cells, labels)[0]


def _value(results: Results, name: str, index: int) -> float:
    return results.summary(name, index).median


def _known(results: Results, index: int) -> bool:
    """Whether all runs of a cell have been made."""
    return None not in results.rows_of(index)


def _ended(results: Results, index: int) -> str:
    """How the first run of a cell ended that did not complete; empty where all did."""
    levels = ", ".join(level for name, level in results.labels(index).items() if name != results.apart)
    ended = (row for row in results.rows_of(index) if row is not None and row.outcome != COMPLETED)
    return next((f"{levels} {row.outcome}: {row.message}" for row in ended), "")


def _named(results: Results, some: Sequence[int], cells: Sequence[int]) -> str:
    """Some of several cells, in the words that tell those from each other."""
    labels = [results.labels(index) for index in cells]
    differing = [name for name in results.factors if len({one[name] for one in labels}) > 1]
    words = [", ".join(results.labels(index)[name] for name in differing) for index in some[:MOST_NAMED]]
    more = f" and {len(some) - MOST_NAMED} more" if len(some) > MOST_NAMED else ""
    return "; ".join(filter(None, words)) + more or "it"
