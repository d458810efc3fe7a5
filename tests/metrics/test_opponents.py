"""Counts of opponents and the least time that one needs, against a run that is worked out by hand."""

from typing import Any

import numpy as np
import pytest

from escort_mj import Run, Scenario, run
from escort_mj.measuring import measure


def fates(again: Any) -> list[tuple[str, int]]:
    """What becomes of the opponents of `test_recomputed`, and in which step."""
    found = []
    for o in range(again.places.shape[1] if "opponents" in again.case.keys else 0):
        place = again.places[:, o]
        robots = np.linalg.norm(again.q - place[:, None], axis=2).min(axis=1) - 0.4 <= 0.3
        inside = np.linalg.norm(again.target - place, axis=1) - 0.5 <= 0.1
        first = {"intercepted": robots, "breached": inside}
        steps = {name: int(np.argmax(now)) for name, now in first.items() if now.any()}
        name = min(steps, key=steps.__getitem__, default="")
        found.append((name, steps.get(name, -1)))
    return found


def recomputed_opponents_intercepted(again: Any) -> float | None:
    """Over a mission of `test_recomputed`."""
    names = [name for name, _ in fates(again)]
    return float(names.count("intercepted")) if names else None


def recomputed_opponents_breached(again: Any) -> float | None:
    """Likewise."""
    names = [name for name, _ in fates(again)]
    return float(names.count("breached")) if names else None


def recomputed_threat_time_min(again: Any) -> float | None:
    """Likewise: opponents come at 0, 0 and 2.5 s."""
    least = []
    for (_, end), start, o in zip(fates(again), (0.0, 0.0, 2.5), range(3), strict=False):
        place = again.places[:, o]
        speed = np.linalg.norm(np.gradient(place, again.time, axis=0), axis=1)
        left = (np.linalg.norm(place - again.target, axis=1) - 0.5) / np.maximum(speed, 1e-9)
        first = int(np.searchsorted(again.time, start - 1e-9))
        least.append(left[first : None if end < 0 else end].min())
    return float(min(least)) if least else None


@pytest.fixture(scope="module")
def flown() -> Run:
    """One opponent runs into a robot, one reaches the target, one is still waiting."""
    return run(
        Scenario(
            duration=6, target={"radius": 0.3},
            robots={"positions": [[4.0, 0.0]], "radius": 0.2, "force_limit": 1e-6, "mass": 1e3},
            mission={"radius": 4.0, "behaviors": ["surface"]}, recording={"rate": 500},
            opponents=[
                {"count": 2, "positions": [[8.0, 0.0], [0.0, 4.0]], "radius": 0.2, "policy": "straight"},
                {"name": "late", "positions": [[0.0, -9.0]], "start": 100},
            ],
        )
    )  # fmt: skip


def test_counts_and_moments(flown: Run) -> None:
    intercepted, breached = (flown.metrics[f"opponents_{word}"] for word in ("intercepted", "breached"))
    assert (intercepted["value"], breached["value"]) == (1.0, 1.0)
    assert intercepted["who"] == "opponent_1" and breached["who"] == "opponent_2"
    braking = 0.5 / 20.0  # s: half of v / (F / m), lost while the body speeds up
    assert intercepted["time"] == pytest.approx(4.0 - 0.7 + braking, abs=0.005)
    assert breached["time"] == pytest.approx(4.0 - 0.6 + braking, abs=0.005)
    assert flown.trace["interceptor"].values[-1].tolist() == [1, 0, 0]
    assert flown.trace["opponent_status"].values[-1].tolist() == [2, 3, 0]


def test_with_teams_the_nearest_target_counts() -> None:
    teams = [
        {"name": name, "robots": [robot], "radius": 3.0,
         "targets": [{"name": f"of_{name}", "position": [x, 0]}]}
        for name, robot, x in (("left", 1, -10), ("right", 2, 10))
    ]  # fmt: skip
    found = run(Scenario(
        duration=2, target=None, teams=teams, robots={"positions": [[-10, 3], [10, 3]]},
        mission={"behaviors": ["surface"]}, recording={"rate": 500},
        opponents=[{"positions": [[10, -8]], "body": {"force_limit": 1e6}}],
    ))  # fmt: skip
    assert found.values["threat_time_min"] == pytest.approx(8.0 - 0.3 - 0.2 - 2.0, abs=0.01)  # at 1 m/s


def test_a_target_without_a_team_is_not_threatened() -> None:
    """The opponent would be at the nearer target in 1.5 s less, but that one has no team until 1 s."""
    nearer = {
        "name": "b",
        "position": [10, -1.5],
        "escorted_by": [{"team": None}, {"after": 1, "team": "one"}],
    }
    teams = [{"name": "one", "robots": [1], "radius": 3.0,
              "targets": [{"name": "a", "position": [10, 0]}, nearer]}]  # fmt: skip
    scenario = Scenario(
        duration=2, target=None, teams=teams, robots={"positions": [[10, 4]]},
        mission={"behaviors": ["surface"]}, recording={"rate": 500},
        opponents=[{"positions": [[10, -8]], "body": {"force_limit": 1e6}}],
    )  # fmt: skip
    trace = run(scenario).trace
    for before, way in ((0.998, 8.0), (2.0, 6.5)):
        found = measure("threat_time_min", trace, before=before)
        assert found.value == pytest.approx(way - 0.3 - 0.2 - before, abs=0.01)


def test_what_is_decided_turns_back(flown: Run) -> None:
    place = flown.trace["obstacle_position"].values
    speed = np.diff(place, axis=0)[-1] / 0.002
    assert speed[0] == pytest.approx([1.0, 0.0], abs=1e-3) and speed[1] == pytest.approx([0.0, 1.0], abs=1e-3)
    assert not speed[2].any()


def test_least_time_to_reach(flown: Run) -> None:
    found = flown.metrics["threat_time_min"]
    assert found["who"] == "opponent_2"
    assert found["value"] == pytest.approx(0.1, abs=0.01)  # the gap of 0.1 m at 1 m/s


def test_without_opponents_there_is_none(compiled: None) -> None:
    quiet = run(Scenario(duration=0.1))
    assert quiet.metrics["opponents_breached"]["value"] is None


def test_each_opponent_is_told_with_its_own_time(compiled: None) -> None:
    made = run("pursuit/intruders")
    verdict = next(each for each in made.verdicts if each.metric == "opponents_intercepted")
    status, time = made.trace["opponent_status"].values, made.trace["time"].values
    names = [str(name) for name in made.trace["obstacle"].values[-status.shape[1] :]]
    caught = sorted((float(time[np.argmax(status[:, k] == 2)]), name) for k, name in enumerate(names))
    for moment, name in caught[1:]:  # of a sample
        assert f"{name} by {moment:.2f} s" in verdict.message
    assert f"5 ({caught[0][1]} at" in verdict.message and not verdict.near_miss
