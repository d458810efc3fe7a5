"""Goals as scenarios give them, and missions without a target: what they become, and what is refused."""

import numpy as np

from escort_mj.scenario.mission import Mission
from escort_mj.scenario.reader.load import scenario_of

ROBOTS = {"positions": [[0.0, 0.0], [4.0, 0.0], [2.0, 3.0]]}


def keys(goals: object, **more: object) -> dict:
    mission = {"behaviors": [{"behavior": "goal", "goals": goals}]}
    return {"target": None, "robots": ROBOTS, "mission": mission, **more}


def goals_of(goals: object, **more: object) -> list[list[list[float]]]:
    (found,) = Mission(scenario_of(keys(goals, **more))).setup.goals
    return [points.tolist() for points in found]


def test_goals_as_given_mirrored_and_drawn() -> None:
    given = [[1.0, 5.0], [[2.0, 6.0], [3.0, 7.0]], [5.0, 5.0]]
    assert goals_of(given) == [[[1.0, 5.0]], [[2.0, 6.0], [3.0, 7.0]], [[5.0, 5.0]]]
    assert goals_of("opposite") == [[[4.0, 2.0]], [[0.0, 2.0]], [[2.0, -1.0]]]
    obstacle = [{"shape": "box", "size": [1.0, 1.0], "position": [5.0, 5.0]}]
    drawn = {"within": 2.5, "center": [5.0, 5.0], "least_gap": 0.3}
    points = np.array(goals_of(drawn, obstacles=obstacle))[:, 0]
    assert goals_of(drawn, obstacles=obstacle) != goals_of(drawn, obstacles=obstacle, seed=1)
    outside = np.maximum(np.abs(points - 5.0) - 1.0, 0.0)
    assert (np.linalg.norm(outside, axis=1) >= 0.5).all()
    assert (np.linalg.norm(points - 5.0, axis=1) <= 2.5).all()
    gaps = np.linalg.norm(points[:, None] - points, axis=2) + 9.0 * np.eye(3)
    assert (gaps >= 0.7).all()
