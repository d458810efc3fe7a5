"""Avoidance by conditions on velocities, in whole missions."""

import numpy as np
import pytest

from escort_mj.api import load_scenario, run, run_many, start
from escort_mj.scenario import Scenario


@pytest.mark.parametrize("count", [2, pytest.param(10, marks=pytest.mark.slow)])
def test_main_holds_for_any_start(compiled, count):
    main = load_scenario("main")
    for flown in run_many([main.replace(seed=seed) for seed in range(1, 1 + count)]):
        assert all(verdict.passed for verdict in flown.verdicts), flown
        assert flown.metrics["contacts"]["value"] == 0.0


@pytest.mark.parametrize("speed", [1.0, 2.0, 4.0])
def test_a_robot_at_speed_stops_outside_its_safe_distance(speed: float, compiled):
    """1 kg, at most 20 N, straight at a rock: the paper's avoidance lets it in by 24, 94 and 306 mm."""
    flown = run(
        Scenario(
            duration=18.0, target=None,
            robots={"radius": 0.15, "force_limit": 20.0, "positions": [[-6.0, 0.05]]},
            obstacles=[{"position": [0, 0], "radius": 0.5}],
            mission={
                "max_speed": speed, "outer": "set_based",
                "behaviors": [
                    {"behavior": "avoid_obstacles", "safe_distance": 0.3},
                    {"behavior": "goal", "gain": 4, "goals": [[6.0, 0.0]]},
                ],
            },
        )
    )  # fmt: skip
    assert flown.metrics["obstacle_clearance_min"]["value"] > 0.3 - 0.0051
    assert flown.metrics["arrived"]["value"] == 1.0


def test_the_target_is_kept_clear_of(compiled):
    """A goal behind the target, which nobody escorts: the paper's avoidance runs into it."""
    keys = {
        "duration": 10.0,
        "target": {"position": [0, 0], "radius": 0.5},
        "robots": {"radius": 0.2, "positions": [[-4.0, 0.02]]},
        "mission": {
            "max_speed": 1.5,
            "outer": "nsb",
            "behaviors": [
                {"behavior": "avoid_obstacles", "safe_distance": 0.4},
                {"behavior": "goal", "goals": [[4.0, 0.0]]},
            ],
        },
    }
    touched = run(Scenario(**keys))
    assert touched.metrics["contacts"]["value"] > 0.0
    kept = run(Scenario(**keys).replace({"mission.outer": {"loop": "set_based", "patience": 1}}))
    assert kept.metrics["contacts"]["value"] == 0.0 and kept.metrics["arrived"]["value"] == 1.0
    near = run(
        Scenario(**keys).replace(
            {"mission.outer": {"loop": "set_based", "patience": 1, "target_distance": 0.1}}
        )
    )
    gaps = [float(each.trace["target_clearance"].values[:, 0].min()) for each in (kept, near)]
    assert gaps[0] > 0.38 and 0.08 < gaps[1] < 0.2


@pytest.mark.parametrize(
    ("body", "far"),
    [({"radius": 0.3}, 0.7), ({"shape": "box", "size": [0.2, 0.8]}, 1.2)],
    ids=["ball", "box"],
)
def test_a_body_that_is_faster_than_a_robot_is_let_pass(body: dict[str, object], far: float, compiled):
    """It cannot be outrun: the robot leaves its path to the side on which it is, and comes back."""
    flown = run(
        Scenario(
            duration=8.0, target=None,
            robots={"radius": 0.2, "positions": [[0.0, 0.05]]},
            obstacles=[{**body, "motion": {"position": ["-8 + 3*t", "0"]}}],
            mission={
                "max_speed": 1.0, "outer": "set_based",
                "behaviors": [
                    {"behavior": "avoid_obstacles", "safe_distance": 0.3},
                    {"behavior": "goal", "goals": [[0.0, 0.05]]},
                ],
            },
        )
    )  # fmt: skip
    assert flown.metrics["obstacle_clearance_min"]["value"] > 0.25
    x, y = flown.trace["q"].values[:, 0].T
    assert y.max() > far and -0.05 < x.min() and x.max() < 0.2, "and flees ahead of it a little"
    assert abs(x[-1]) < 0.05 and abs(y[-1] - 0.05) < 0.05


@pytest.mark.parametrize(("toward", "woken"), [(1, 1), (3, 3)])
def test_a_robot_at_rest_makes_room_for_one_that_is_pushed_at_it(toward: int, woken: int, compiled):
    """On a ring of six: with a look for its own speed alone, it noticed 0.2 s later, at 0.35 m."""
    turns = np.arange(6) * (np.pi / 3)
    ring = (2.2 * np.column_stack([np.cos(turns), np.sin(turns)])).round(6)
    mission = start(
        Scenario(
            duration=3.0, target=None,
            robots={"radius": 0.2, "mass": 1.0, "force_limit": 10.0, "positions": ring.tolist()},
            mission={
                "max_speed": 2.0, "outer": "set_based",
                "behaviors": [
                    {"behavior": "avoid_obstacles", "safe_distance": 0.4, "teammate_distance": 0.4},
                    {"behavior": "goal", "goals": ring.tolist()},
                ],
            },
        )
    )  # fmt: skip
    mission.step(1.0)
    way = ring[toward - 1] - ring[1]
    mission.push(2, (60.0 * way / np.linalg.norm(way)).tolist(), 0.2)
    mission.step(2.0)
    flown = mission.run()
    time, speed = flown.trace["time"].values, np.linalg.norm(flown.trace["v_d"].values[:, woken - 1], axis=1)
    place = flown.trace["q"].values
    awake = int(np.flatnonzero((time > 1.0) & (speed > 0.05))[0])
    gap = float(np.linalg.norm(place[awake, 1] - place[awake, woken - 1])) - 0.4
    assert gap > 1.0


@pytest.mark.parametrize("speed", [1.5, 4.0])
def test_a_robot_that_holds_its_velocity_makes_room(speed: float, compiled):
    """A trigger lets go of updates, not of conditions: a ball comes at a robot that rests at its goal."""
    scenario = Scenario(
        duration=5.0, target=None,
        robots={"radius": 0.15, "positions": [[0.0, 0.1]]},
        obstacles=[{"radius": 0.3, "motion": {"position": [f"-4 + {speed}*t", "0"]}}],
        mission={
            "max_speed": 2.0, "outer": "set_based",
            "behaviors": [
                {"behavior": "avoid_obstacles", "safe_distance": 0.3},
                {"behavior": "goal", "goals": [[0.0, 0.1]]},
            ],
        },
    )  # fmt: skip
    every, held = (
        run(scenario.replace({"mission.trigger": trigger}))
        for trigger in (None, {"longest": 10, "distance": 0.5})
    )
    assert held.trace["outer_updates"].values[-1] < 0.5 * every.trace["outer_updates"].values[-1]
    clearance = "obstacle_clearance_min"
    assert held.values[clearance] == pytest.approx(every.values[clearance], abs=1e-3)
