"""All that expectations ask about steps has the same bits in blocks of any length."""

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from escort_mj import Scenario, load_scenario
from escort_mj.errors import ScenarioError
from escort_mj.metrics.metric import Metric
from escort_mj.metrics.watching import Folded
from escort_mj.mission import fly
from escort_mj.scenario.kinds import KINDS
from escort_mj.world.model.build import build
from escort_mj.world.watcher import Watcher
from tests.corpus import read

MISSIONS = read(Path(__file__).with_name("blocks.yaml"))
EACH = {m.name: {"metric": m.name, "at_least": max(m.least, 0.0) + 0.1} for m in KINDS[Metric] if m.watches}
BESIDE = ({"clearance": ["robots", "robots"], "at_least": 0.0}, {"settled": 0.3, "by": 0.2})


@lru_cache
def asking(name: str) -> Scenario:
    """A short mission of many robots that asks all it can about every step."""
    mission = MISSIONS[name]
    plain = load_scenario(mission["of"], mission["set"] | {"duration": 0.4, "expect": [], "seed": 5})
    asked = list(BESIDE) if plain.target is not None else [{"reached": 0.3, "by": 0.2}]
    for each in EACH.values():
        try:
            plain.replace(expect=[*asked, each])
        except ScenarioError:
            continue
        asked.append(each)
    return plain.replace({"recording.rate": round(1.0 / plain.physics.timestep)}, expect=asked)


@pytest.mark.slow_cases("knowledge", "space")
@pytest.mark.parametrize("name", MISSIONS)
def test_bits_do_not_depend_on_the_block(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[np.ndarray] = []
    plain = Watcher.fold

    def fold(self: Watcher, steps: np.ndarray, starts: np.ndarray) -> Folded:
        found.append(steps.copy())
        return plain(self, steps, starts)

    monkeypatch.setattr(Watcher, "fold", fold)
    scenario = asking(name)
    fly(scenario)
    monkeypatch.undo()
    steps, watcher = np.concatenate(found), Watcher(build(scenario))
    for stride in (1, 10):
        starts = np.arange(0, len(steps), stride)
        whole = watcher.fold(steps, starts)
        alone = [watcher.fold(steps[start : start + stride], starts[:1]) for start in starts]
        for part, each in zip(whole, zip(*alone, strict=True), strict=True):
            np.testing.assert_array_equal(part, np.concatenate(each))


def test_all_are_tried() -> None:
    tried = {one.metric for name in MISSIONS for one in asking(name).expect if hasattr(one, "metric")}
    assert tried == set(EACH)
