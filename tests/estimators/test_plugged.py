"""Estimators of plugins: both forms, several threads, the bits of one that ships, and wrong ones."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from escort_mj import Run, load_scenario, run
from escort_mj.errors import ScenarioError
from escort_mj.mission.batch import fly_many
from escort_mj.scenario import json_schema, load_file
from escort_mj.scenario.reader.catalog import scenario_type_with
from tests.control.test_knowing import RADIOS, SIGHTS, informed
from tests.control.twins import compare
from tests.plugged import COMPILED, plugin

ESTIMATOR, SCENARIO = plugin("estimator", "alpha_beta.py", "plain.py", "copied.py")
COPIED = """
from typing import Literal

from escort_mj.estimators import Predict


class Copied(Predict):
    estimator: Literal["copied"] = "copied"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("estimators")
    (made / "alpha_beta.py").write_text(ESTIMATOR + COMPILED)
    (made / "plain.py").write_text(ESTIMATOR.replace('"alpha_beta"', '"plain"'))
    (made / "copied.py").write_text(COPIED)
    (made / "own.yaml").write_text(SCENARIO)
    return made


def flown(folder: Path, estimator: str) -> Run:
    return run(load_scenario(folder / "own.yaml", [f"knowledge.estimator={estimator}"]))


def estimates(found: Run) -> np.ndarray:
    return np.asarray(found.trace["target_estimate"].values)


def test_both_forms_agree_and_threads_change_no_bit(compiled: None, folder: Path) -> None:
    first = estimates(flown(folder, "alpha_beta"))
    assert np.abs(first - estimates(flown(folder, "plain"))).max() < 1e-9
    assert np.ptp(first[-1], axis=0).max() < 0.2 < np.ptp(first[0], axis=0).max()
    for name in ("alpha_beta", "plain"):
        scenario = load_scenario(folder / "own.yaml", [f"knowledge.estimator={name}"])
        runs = [each.trace for each in fly_many([scenario] * 4, threads=2, traces=True)]
        bits = {trace["target_estimate"].values.tobytes() + trace["q"].values.tobytes() for trace in runs}
        assert len(bits) == 1


def test_one_that_ships_has_the_same_bits_as_a_plugin(compiled: None, folder: Path) -> None:
    assert estimates(flown(folder, "copied")).tobytes() == estimates(flown(folder, "predict")).tobytes()


@pytest.mark.parametrize("axes", [2, 3])
def test_the_twin_of_the_controller_knows_it(compiled: None, folder: Path, axes: int) -> None:
    estimator = load_file(folder / "own.yaml").knowledge.estimator
    setup, q, v = informed(axes, 4, sight=SIGHTS["everybody"], radio=RADIOS["late and lossy"])
    compare(replace(setup, estimator=estimator, start_deviation=(0.5, 0.2, 0.0)), q, v, steps=8)


def test_scenarios_know_its_parameters_and_what_it_needs(folder: Path) -> None:
    table = json_schema(scenario_type_with([str(folder / "plain.py")]))["$defs"]["AlphaBeta"]["properties"]
    assert table["alpha"]["exclusiveMinimum"] == 0
    for wrong, said in (
        ({"knowledge.estimator": {"estimator": "plain", "alpha": 2}}, "found 2; expected at most 1"),
        ({"knowledge.estimator": "plane"}, 'did you mean "plain"?'),
        ({"knowledge.target.measures": ["velocity"]}, "the estimator alpha_beta needs position"),
    ):
        with pytest.raises(ScenarioError) as caught:
            load_file(folder / "own.yaml", wrong)
        (fault,) = caught.value.faults
        assert said in str(fault)
