"""What distances a behavior keeps is all that outer loops know of how it avoids bodies."""

from pathlib import Path

import numpy as np
import pytest

import escort_mj
from escort_mj.errors import EscortError

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


@pytest.mark.slow_cases("barrier_filter", "potential_field")
@pytest.mark.parametrize("outer", ["set_based", "barrier_filter", "potential_field"])
def test_a_plugins_distances_are_kept_as_ours(compiled: None, tmp_path: Path, outer: str) -> None:
    ours, theirs, free = (flown(tmp_path, each, outer).trace["q"].values for each in (OURS, "shy", None))
    assert np.array_equal(ours, theirs) and not np.array_equal(ours, free)


@pytest.mark.slow
def test_nsb_asks_its_task(compiled: None, tmp_path: Path) -> None:
    theirs, free = (flown(tmp_path, each, "nsb").trace["q"].values for each in ("shy", None))
    assert np.array_equal(theirs, free)


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ("return 0.8", r"shy\.py:13: TypeError: avoidance returned 0\.8; expected an Avoidance, or None"),
        ('return Avoidance(float("nan"))', "safe_distance: found nan; expected a finite number"),
        ("return Avoidance(1.0, -1.0)", r"avoidance returned teammate_distance=-1\.0; expected 0 or more"),
        ("return setup.nothing", r"shy\.py:15: AttributeError: .*nothing"),
    ],
)
def test_what_a_plugin_says_of_its_distances_is_looked_at(tmp_path: Path, told: str, words: str) -> None:
    (plugin := tmp_path / "shy.py").write_text(
        SHY.replace("return Avoidance(1.5, teammate_distance=0.8, to_surface=1.0)", told)
    )
    keys = {"mission.behaviors": ["shy", "vertices", "surface"]}
    with pytest.raises(EscortError, match=words):
        escort_mj.run(escort_mj.load_scenario("patrol", keys, [str(plugin)]))


def test_its_method_takes_the_mission(tmp_path: Path) -> None:
    (plugin := tmp_path / "shy.py").write_text(SHY.replace("(self, setup)", "(self)"))
    with pytest.raises(EscortError, match=r"takes \(self\); it is called with \(self, setup\)"):
        escort_mj.load_scenario("patrol", {}, [str(plugin)])
