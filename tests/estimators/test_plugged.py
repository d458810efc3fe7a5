"""Estimators of plugins: both forms, several threads, the bits of one that ships, and wrong ones."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from escort_mj import Run, load_scenario, run
from escort_mj.errors import PluginError, ScenarioError
from escort_mj.mission.batch import fly_many
from escort_mj.record.outcome import Outcome
from escort_mj.scenario import json_schema, load_file
from escort_mj.scenario.reader.catalog import scenario_type_with
from escort_mj.scenario.reader.plugins import load_plugin, source_of
from tests.control.test_knowing import RADIOS, SIGHTS, informed
from tests.control.twins import compare
from tests.plugged import COMPILED, ESTIMATOR

SCENARIO = """
duration: 2
target: {position: [0.3*t, 0]}
plugins: [alpha_beta.py, plain.py, copied.py]
knowledge:
  estimator: alpha_beta
  target: {robots: [1, 2], rate: 50, measures: [position, velocity], noise: {position: 0.02}}
  initial: {position: 0.5}
communication: {rate: 20, delay: 0.04, loss: 0.2}
"""
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


LATE = "r.time > 0.51"
RAISES = ("elapsed =", f"if {LATE}:\n            raise ZeroDivisionError('told to')\n        elapsed =")
INFINITE = ("self.alpha * error", f"self.alpha * error * (np.inf if r.i == 1 and {LATE} else 1.0)")


@pytest.mark.parametrize("form", ["", COMPILED], ids=["NumPy", "compiled"])
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (RAISES, "ZeroDivisionError: told to"),
        (INFINITE, "AlphaBeta gave robot 2 a belief that is not a finite number"),
    ],
    ids=["raises", "infinite"],
)
def test_what_it_does_wrong_ends_the_run_with_its_place(
    compiled: None, folder: Path, tmp_path: Path, change: tuple[str, str], form: str, said: str
) -> None:
    text = "import numpy as np\n" + (ESTIMATOR + form).replace(*change)
    (tmp_path / "plain.py").write_text(text.replace('"alpha_beta"', '"plain"'))
    (tmp_path / "own.yaml").write_text(SCENARIO.replace("alpha_beta.py, plain.py, copied.py", "plain.py"))
    found = flown(tmp_path, "plain")
    assert found.outcome is Outcome.FAILED
    assert re.search(rf" at 0.52 s: .*/plain.py:\d+: {said}$", found.message), found.message
    assert np.isfinite(estimates(found)[:-1]).all()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("def sees(", "def saw("), "has no sees(self, r)"),
        (("(self, r: Witness)", "(self)"), "takes (self); it is called with (self, r"),
        (
            ("def sees(self, r: Witness)", "def update(self, view, robot)"),
            "expected sees(self, r), and hears",
        ),
        (('(("position",),)', '("position",)'), "found needs = ('position',) (line 12); expected sets"),
        (('(("position",),)', '(("place",),)'), "expected sets of position, velocity, range, bearing, as in"),
        (("    def sees(", "    orders = property(lambda self: 4)\n\n    def sees("), "orders = 4 and"),
        (('Literal["alpha_beta"] = "alpha_beta"', 'str = "alpha_beta"'), "does not say its name"),
        (("class AlphaBeta(Estimator)", "class AlphaBeta(Witness)"), "Policy, Estimator, Radio"),
    ],
)
def test_a_wrong_one_is_one_message(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    assert change[0] in ESTIMATOR
    (tmp_path / "own.py").write_text(ESTIMATOR.replace(*change))
    with pytest.raises(PluginError) as caught:
        load_plugin(source_of("own.py", tmp_path))
    assert said in str(caught.value) and "\n" not in str(caught.value)


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
