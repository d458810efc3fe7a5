"""What distances a behavior keeps is all that outer loops know of how it avoids bodies."""

from pathlib import Path

import numpy as np
import pytest

import escort_mj

SHY = '''
from typing import ClassVar, Literal

from escort_mj.plugins import Avoidance, Behavior, Robots, Task, move


class Shy(Behavior):
    """Keep away from bodies, by what outer loops do."""

    frame: ClassVar[Literal["target", "world"]] = "world"
    behavior: Literal["shy"] = "shy"

    def avoidance(self, setup) -> Avoidance:
        """Return the distances."""
        return Avoidance(1.5, teammate_distance=0.8, to_surface=1.0)

    def task(self, r: Robots) -> Task:
        """Return a task that asks nothing."""
        return move(0.0 * r.q, 0.0 * r.robot_radius, 0.0 * r.robot_radius)
'''
OURS = {"behavior": "avoid_obstacles", "safe_distance": 1.5, "teammate_distance": 0.8, "sidestep": 0}


def flown(folder: Path, avoids: object, outer: str) -> escort_mj.Run:
    (plugin := folder / "shy.py").write_text(SHY)
    keys = {"duration": 20, "expect": [], "mission.outer": outer}
    keys |= {"mission.behaviors": [*([avoids] if avoids else []), "vertices", "surface"]}
    return escort_mj.run(escort_mj.load_scenario("patrol", keys, [str(plugin)]))


@pytest.mark.parametrize("outer", ["set_based", "barrier_filter", "potential_field"])
def test_a_plugins_distances_are_kept_as_ours(compiled: None, tmp_path: Path, outer: str) -> None:
    ours, theirs, free = (flown(tmp_path, each, outer).trace["q"].values for each in (OURS, "shy", None))
    assert np.array_equal(ours, theirs) and not np.array_equal(ours, free)


def test_nsb_asks_its_task(compiled: None, tmp_path: Path) -> None:
    theirs, free = (flown(tmp_path, each, "nsb").trace["q"].values for each in ("shy", None))
    assert np.array_equal(theirs, free)
