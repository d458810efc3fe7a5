"""Every scenario that ships: it loads, builds, repeats to the bit, names its schema, holds its verdicts."""

import re
from pathlib import Path

import numpy as np
import pytest

from escort_mj.mission import fly
from escort_mj.record.outcome import Outcome
from escort_mj.scenario import load_file

FOLDER = Path(__file__).parents[1] / "scenarios"
SCENARIOS = sorted(
    path
    for path in FOLDER.rglob("*.y*ml")
    if not any(word.startswith("stud") for word in path.relative_to(FOLDER).parts)
)
WELL = [path for path in SCENARIOS if path.parent.name != "faults"]  # those: tests/test_faults.py
MAY_BE_INFINITE = ("lidar_range", "clearance", "target_clearance", "body_thickness")
# Nothing but the beginning, and nothing demanded of it.
SHORT = {"duration": 0.2, "expect": [], "robots.failures": []}


def test_there_are_scenarios() -> None:
    names = {str(path.relative_to(FOLDER)) for path in SCENARIOS}
    assert {"main.yaml", "main_3d.yaml", "paper/case1_2d.yaml", "paper/case3_3d_obstacle.yaml"} <= names


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: str(path.relative_to(FOLDER)))
def test_first_line_names_the_schema(path: Path) -> None:
    line = path.read_text().splitlines()[0]
    found = re.fullmatch(r"# yaml-language-server: \$schema=(\S+)", line)
    assert found, line
    assert (path.parent / found[1]).resolve() == (FOLDER / "schema.json").resolve()


@pytest.mark.parametrize("path", WELL, ids=lambda path: str(path.relative_to(FOLDER)))
def test_runs_and_repeats(path: Path, compiled: None) -> None:
    scenario = load_file(path, SHORT)
    assert scenario.name == path.stem and scenario.description
    first, second = fly(scenario), fly(scenario)
    assert first.outcome is Outcome.COMPLETED, first.message
    assert first.passed
    assert first.trace.sizes["time"] == round(0.2 * scenario.recording.rate) + 1
    for name, variable in first.trace.variables.items():
        if variable.dtype.kind == "f":
            nothing_near = np.isposinf(variable.values) if name in MAY_BE_INFINITE else False
            assert (np.isfinite(variable.values) | nothing_near).all(), name
        if variable.dtype.kind in "fi":
            assert variable.values.tobytes() == second.trace[name].values.tobytes(), name
    touched = first.trace["body_group"].values[first.trace["episode_second"].values.astype(int)]
    assert set(touched) <= {"floor"}, "nothing touches, but for what rolls"


@pytest.mark.slow
@pytest.mark.parametrize("path", WELL, ids=lambda path: str(path.relative_to(FOLDER)))
def test_it_holds_what_it_promises(path: Path, compiled: None) -> None:
    flight = fly(load_file(path))
    assert flight.passed, (flight.message, [verdict for verdict in flight.verdicts if not verdict.passed])
