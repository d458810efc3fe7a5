"""Networks of learned policies: read from files, and refused with one clear error."""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from escort_mj import load_scenario
from escort_mj.errors import ScenarioError
from escort_mj.policies.learned import Learned, inputs
from escort_mj.scenario import dump_scenario

GOOD: dict[str, Any] = {
    "weights_1": np.ones((3, inputs(2))),
    "bias_1": np.zeros(3),
    "weights_2": np.ones((2, 3)),
    "bias_2": np.zeros(2),
}
WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "no_bias": ({"bias_2": None}, "net.npz: bias_2 is missing"),
    "other_names": ({"w": np.ones(1)}, "found w; expected the arrays weights_1, bias_1"),
    "axes": ({"bias_1": np.ones((3, 1))}, r"bias_1: found float64 of the shape \(3, 1\); expected finite"),
    "not_finite": ({"bias_1": np.full(3, np.nan)}, "bias_1: found float64"),
    "objects": ({"bias_1": np.array([None] * 3)}, "cannot be read: .*pickle"),
    "large": ({"weights_1": np.ones((600, 600))}, "found 2,880,.* bytes; expected at most"),
    "inputs": ({"weights_1": np.ones((3, 5))}, "found 5 inputs and 2 outputs; expected 22 and 2 in 2 axes"),
    "chain": ({"weights_2": np.ones((2, 4))}, "layer 2 of the network: found rows of 4 weights; expected 3"),
}
TEXT = "opponents: [{policy: {policy: learned, network: net.npz}}]\n"


def written(folder: Path, arrays: dict[str, Any], text: str = TEXT) -> Path:
    np.savez(folder / "net.npz", **{name: array for name, array in arrays.items() if array is not None})
    (folder / "mission.yaml").write_text(text)
    return folder / "mission.yaml"


def test_a_file_becomes_part_of_the_scenario(tmp_path: Path) -> None:
    scenario = load_scenario(written(tmp_path, GOOD))
    policy = scenario.opponents[0].policy
    assert isinstance(policy, Learned)
    assert [np.shape(layer.weights) for layer in policy.network] == [(3, 22), (2, 3)]
    (tmp_path / "net.npz").unlink()
    (tmp_path / "again.yaml").write_text(dump_scenario(scenario))
    assert load_scenario(tmp_path / "again.yaml") == scenario


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_file_is_one_error(tmp_path: Path, case: str) -> None:
    arrays, words = WRONG[case]
    with pytest.raises(ScenarioError, match=words) as raised:
        load_scenario(written(tmp_path, GOOD | arrays))
    assert len(raised.value.faults) == 1 and raised.value.faults[0].key.startswith("opponents[0].policy")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("none.npz", "there is no such file"),
        ("../net.npz", "leads out of the scenario's folder"),
        ("mission.yaml", "the name of a file with the suffix .npz"),
        ("text.npz", "cannot be read"),
        ("texts.npz", "bias_1 is no array of NumPy"),
    ],
)
def test_a_wrong_name_is_one_error(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "text.npz").write_text("no archive")
    with zipfile.ZipFile(tmp_path / "texts.npz", "w") as archive:
        archive.writestr("bias_1.npy", b"0 0")
    with pytest.raises(ScenarioError, match=words) as raised:
        load_scenario(written(tmp_path, GOOD, TEXT.replace("net.npz", name)))
    assert len(raised.value.faults) == 1


def test_a_learned_policy_needs_a_network(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="found none; give the name of a .npz file"):
        load_scenario(written(tmp_path, GOOD, "target: {policy: learned}\n"))
