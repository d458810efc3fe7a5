"""Trees become models once, or twice where what the compiler found does not fit."""

import mujoco
import pytest

from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.model import compiling
from escort_mj.world.model.build import build

ROBOTS = {"positions": [[4, 1], [-3, 2.5], [0.25, -6]]}


@pytest.mark.parametrize(
    ("more", "guess", "times"),
    [({}, 0, 1), ({}, 7, 2), ({"velocities": [[1, 0], [0, 0], [0, 0]]}, 0, 2)],
    ids=["at rest", "more geoms than the tree shows", "moving"],
)
def test_a_world_is_compiled_again_only_where_it_must_be(
    more: dict, guess: int, times: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Either way the model is that of its text."""
    compiled, trees = compiling._compiled, []
    size = compiling.addresses_size
    monkeypatch.setattr(
        compiling, "_compiled", lambda tree, files: trees.append(tree) or compiled(tree, files)
    )
    monkeypatch.setattr(compiling, "addresses_size", lambda *what: size(*what) - guess)
    world = build(Scenario.model_validate({"robots": ROBOTS | more}))
    assert len(trees) == times
    again = mujoco.MjModel.from_xml_string(world.xml)
    assert again.numeric_data.tobytes() == world.model.numeric_data.tobytes()
    assert again.key_qvel.tobytes() == world.model.key_qvel.tobytes()
