"""The paper's simulations, three laws in seven cases by three readings of the force limit; its figures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

from escort_mj.errors import UsageError
from escort_mj.scenario import Scenario, load_file
from escort_mj.study.compare.laws import controller_of

CASES = {
    "case1_2d": "case 1, plane",
    "case1_3d": "case 1, space",
    "case2_2d": "case 2, plane",
    "case2_2d_obstacles": "case 2, plane, obstacles",
    "case2_3d": "case 2, space",
    "case3_2d": "case 3, plane",
    "case3_3d_obstacle": "case 3, space, obstacle",
}
LAWS = {"apd_smc": "APD-SMC", "asmc": "ASMC", "pd_smc": "PD-SMC"}


class Reading(NamedTuple):
    """One way to read what the paper leaves open: how its laws live with their force limit.

    Attributes:
        words: For tables and titles.
        limited: Whether the paper's limit of 10 N holds.
        anti_windup: Whether the law knows of it.
        gain: Of avoidance: as eq. 24 prints it, or as eq. 23 requires.
    """

    words: str
    limited: bool
    anti_windup: bool
    gain: Literal["printed", "consistent"]


READINGS = {
    "unlimited": Reading("as printed, no force limit", False, False, "printed"),
    "limited": Reading("as printed, 10 N limit", True, False, "printed"),
    "anti_windup": Reading("10 N limit, anti-windup", True, True, "consistent"),
}


class PaperRun(NamedTuple):
    """One run of the reproduction; its fields are keys of `CASES`, `LAWS` and `READINGS`."""

    case: str
    law: str
    reading: str

    @property
    def name(self) -> str:
        """Name of its run folder and of its scenario."""
        return "-".join(self)


class PaperFigure(NamedTuple):
    """One figure of the paper, or ours beside them.

    Attributes:
        key: Its number in the paper, or a name.
        kind: What it shows: `panels`, `paths`, `obstacles` or `laws`.
        case: Whose; empty for all of them.
        law: Whose; empty for all of them.
    """

    key: str
    kind: str
    case: str = ""
    law: str = "apd_smc"

    @property
    def file(self) -> str:
        """Name of its file without suffix."""
        return f"fig{int(self.key):02d}" if self.key.isdigit() else self.key


FIGURES = (
    PaperFigure("5", "panels", "case1_2d"),
    PaperFigure("6", "panels", "case1_2d", "asmc"),
    PaperFigure("7", "paths", "case1_3d"),
    PaperFigure("8", "panels", "case2_2d"),
    PaperFigure("9", "paths", "case2_2d_obstacles"),
    PaperFigure("10", "obstacles", "case2_2d_obstacles"),
    PaperFigure("11", "paths", "case2_3d"),
    PaperFigure("12", "panels", "case2_3d"),
    PaperFigure("13", "panels", "case2_3d", "asmc"),
    PaperFigure("14", "paths", "case3_2d"),
    PaperFigure("15", "panels", "case3_2d"),
    PaperFigure("16", "paths", "case3_3d_obstacle"),
    PaperFigure("17", "obstacles", "case3_3d_obstacle"),
    PaperFigure("laws", "laws", law=""),
)
SHOWN = ("anti_windup", "unlimited")  # readings that a figure of one law shows


def simulations() -> list[PaperRun]:
    """All of them, in the order of the tables."""
    return [PaperRun(case, law, reading) for case in CASES for law in LAWS for reading in READINGS]


def needed(figures: Iterable[PaperFigure]) -> list[PaperRun]:
    """What must have run for these figures."""
    wanted = set()
    for figure in figures:
        for simulation in simulations():
            ours = figure.kind == "laws" or simulation.reading in SHOWN
            if ours and figure.case in ("", simulation.case) and figure.law in ("", simulation.law):
                wanted.add(simulation)
    return [simulation for simulation in simulations() if simulation in wanted]


def chosen_figures(only: Sequence[str]) -> list[PaperFigure]:
    """The figures that a user names, such as `5`, `fig05` or `5,6`; all of them if none is named.

    Raises:
        UsageError: If there is no such figure.
    """
    words = [word.strip().lower() for text in only for word in text.split(",") if word.strip()]
    known = {figure.key: figure for figure in FIGURES}
    keys = [word.removeprefix("fig").lstrip(".0") if word not in known else word for word in words]
    unknown = sorted({word for word, key in zip(words, keys, strict=True) if key not in known})
    if unknown:
        raise UsageError(
            f"--only {', '.join(unknown)}: there is no such figure; "
            f"those of the paper's simulations are 5 to 17, and `laws` compares the laws"
        )
    return [figure for figure in FIGURES if not words or figure.key in keys]


def paper_scenario(simulation: PaperRun, scenarios: Path) -> Scenario:
    """The scenario of a simulation: the paper's case with what law and reading change.

    Args:
        simulation: Which.
        scenarios: Folder of the shipped scenarios, that holds `paper/`.
    """
    path = scenarios / "paper" / f"{simulation.case}.yaml"
    base = _as_printed(path, path.stat().st_mtime_ns)
    reading = READINGS[simulation.reading]
    overrides: dict[str, Any] = {
        "name": simulation.name,
        "controller": controller_of(base, simulation.law).model_dump() | {"anti_windup": reading.anti_windup},
        "mission.behaviors": [
            behavior.model_dump() | ({"gain": reading.gain} if behavior.behavior == "avoid_obstacles" else {})
            for behavior in base.mission.behaviors
        ],
        "expect": [],  # what the shipped files expect is expected of their own law and reading
    }
    if not reading.limited:
        overrides["robots.force_limit"] = None
    return load_file(path, overrides)


@cache
def _as_printed(path: Path, changed: int) -> Scenario:
    """A scenario as it is shipped, read once; `changed` is the file's time."""
    return load_file(path)
