"""A study as its YAML tells it: one scenario, what is varied, how often, and what is kept."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, PositiveFloat, PositiveInt, Tag, ValidationError

from escort_mj.control.parameters import Parameters
from escort_mj.errors import Fault, ScenarioError
from escort_mj.scenario import explain
from escort_mj.scenario.document import Document, read
from escort_mj.scenario.fields import RUN_NAME
from escort_mj.scenario.findings import Finding, key_path, parse_key_path
from escort_mj.scenario.load import read_text, tuples
from escort_mj.scenario.schema import Scenario

MOST_RUNS = 1_000_000


class Range(Parameters):
    """Numbers between two bounds."""

    low: float
    """Least value, in the key's unit."""
    high: float
    """Largest value, in the key's unit."""
    scale: Literal["linear", "log"] = "linear"
    """How values are spread between them."""
    whole: bool = False
    """Whether only whole numbers are meant."""


class Steps(Range):
    """Evenly spread numbers, both bounds among them."""

    count: Annotated[int, Field(ge=2, le=10_000)]
    """How many."""


Levels = Annotated[
    Annotated[tuple[Any, ...], Tag("list")] | Annotated[Steps, Tag("steps")],
    Discriminator(lambda value: "steps" if isinstance(value, dict | Steps) else "list"),
]
"""Values of one factor: written out, or evenly spread."""


class Sample(Parameters):
    """Points drawn from a box of ranges."""

    method: Literal["sobol", "latin_hypercube", "random"] = "sobol"
    """`sobol` and `latin_hypercube` cover the box more evenly than `random`."""
    count: Annotated[int, Field(ge=1, le=MOST_RUNS)]
    """How many points."""
    seed: Annotated[int, Field(ge=0, lt=2**53)] = 0
    """Seed of the drawing."""
    over: Annotated[dict[str, Range], Field(min_length=1)]
    """Scenario keys, such as `robots.mass`, and the range of each."""


class Limit(Parameters):
    """How large a study may be before it has to be confirmed."""

    runs: PositiveInt = 5000
    """Runs that are still to be made."""
    hours: PositiveFloat = 1.0
    """Time that they would take [h], judged by one of them."""


class Study(Parameters):
    """Many runs of one scenario: every cell of the design, with every seed."""

    study: Annotated[str, Field(pattern=RUN_NAME)]
    """Name of the study, of its folder and its report."""
    version: Literal[1] = 1
    """Version of this format."""
    description: Annotated[str, Field(max_length=4000)] = ""
    """What the study is to find out."""
    scenario: str
    """A scenario file beside this one, or the name of a shipped scenario."""
    set: dict[str, Any] = {}
    """Scenario keys and the value that they have in every run."""
    cases: Annotated[dict[str, dict[str, Any]], Field(max_length=1000)] = {}
    """Named alternatives, each a table of scenario keys and values."""
    vary: Annotated[dict[str, Levels], Field(max_length=16)] = {}
    """Scenario keys and their values, a list or evenly spread; every combination is a cell."""
    sample: Sample | None = None
    """Points drawn from ranges, beside the combinations above."""
    seeds: Annotated[int, Field(ge=1, le=100_000)] = 1
    """Seeds of every cell, the same for all cells: noise and random starts are paired."""
    first_seed: Annotated[int, Field(ge=0, lt=2**53)] | None = None
    """The first of them; null: the scenario's own."""
    traces: Literal["none", "failed", "all"] = "none"
    """Whose run folders are kept: of no run, of those that fail a verdict or break, of all."""
    at_most: Limit = Limit()
    """Beyond this the study has to be confirmed."""


class StudyFile:
    """A checked study with its text's places, for faults that show only when its cells are tried.

    Attributes:
        path: The file.
        study: What it says.
    """

    def __init__(self, path: Path, study: Study, document: Document) -> None:
        self.path, self.study, self._document = path, study, document

    def fault(self, message: str, *path: str | int) -> Fault:
        """A fault with its place in the file."""
        place = self._document.place(path)
        return Fault(message, key_path(path), place.line, place.column, place.source)


def is_study(document: Document) -> bool:
    """Whether a YAML file is a study and not a scenario."""
    return isinstance(document.data, dict) and "study" in document.data


def load_study(path: str | os.PathLike[str]) -> StudyFile:
    """Reads and checks a study file; the scenario that it names is read by `design.Design`.

    Raises:
        UsageError: If there is no such file or it cannot be read.
        ScenarioError: With every fault found.
    """
    source = os.fspath(path)
    document = read(read_text(Path(source)), source)
    if not is_study(document):
        message = "is no study: a study names itself with the key study, and its scenario with scenario"
        raise ScenarioError([Fault(message, source=source)])
    try:
        study = Study.model_validate(tuples(document.data), strict=True)
    except ValidationError as error:
        findings = explain.findings(error, document.data, Study)
    else:
        findings = list(_findings(study))
        if not findings:
            return StudyFile(Path(source), study, document)
    faults = []
    for finding in findings:
        place = document.place(finding.path, finding.at_key)
        faults.append(Fault(finding.message, key_path(finding.path), place.line, place.column, place.source))
    raise ScenarioError(sorted(faults, key=lambda fault: (fault.line, fault.column)))


def _findings(study: Study) -> list[Finding]:
    """What is wrong between the keys of a study."""
    found = []
    seen: dict[str, str] = {}
    tables: list[tuple[tuple[str | int, ...], str]] = [(("set", key), key) for key in study.set]
    tables += [(("vary", key), key) for key in study.vary]
    tables += [(("sample", "over", key), key) for key in (study.sample.over if study.sample else ())]
    tables += [(("cases", name, key), key) for name, case in study.cases.items() for key in case]
    for path, key in tables:
        where = key_path(path[:-1])
        if parse_key_path(key) is None:
            found.append(Finding(path, "is no key path of a scenario, such as robots.mass", at_key=True))
        elif key in ("seed", "name", "version"):
            found.append(
                Finding(path, f"{key} cannot be varied; seeds and first_seed say which", at_key=True)
            )
        elif path[0] in ("vary", "sample") and key in seen:
            found.append(Finding(path, f"is given in {seen[key]} too", at_key=True))
        if path[0] != "set":
            seen.setdefault(key, where)
    ranges: list[tuple[tuple[str, ...], Range]]
    ranges = [(("vary", key), value) for key, value in study.vary.items() if isinstance(value, Range)]
    ranges += [
        (("sample", "over", key), value) for key, value in (study.sample.over if study.sample else {}).items()
    ]
    for path, value in ranges:
        if not value.low < value.high:
            found.append(
                Finding((*path, "high"), f"found {value.high:g}; expected more than low, {value.low:g}")
            )
        elif value.scale == "log" and value.low <= 0.0:
            found.append(
                Finding((*path, "low"), f"found {value.low:g}; a logarithmic scale needs more than 0")
            )
    found += [Finding(("vary", key), "has no values") for key, value in study.vary.items() if value == ()]
    return found


__all__ = ["Limit", "Range", "Sample", "Scenario", "Steps", "Study", "StudyFile", "is_study", "load_study"]
