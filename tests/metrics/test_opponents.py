"""Counts of opponents and the least time that one needs, against a run that is worked out by hand."""

import numpy as np
import pytest

from escort_mj import Run, Scenario, run


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


def test_what_is_decided_turns_away(flown: Run) -> None:
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
