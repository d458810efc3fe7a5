import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from escort_mj.errors import ScenarioError
from escort_mj.scenario import Scenario, parse_scenario, robot_count, team


def gaps(scenario: Scenario) -> np.ndarray:
    """Surface-to-surface distances of each robot to the robots after it, obstacles and target."""
    robots = team(scenario)
    bodies = [(o.position, o.radius) for o in scenario.obstacles]
    bodies += [((0.0,) * scenario.axes, scenario.target.radius)]
    position = np.concatenate([robots.position, [body[0] for body in bodies]])
    radius = np.concatenate([robots.radius, [body[1] for body in bodies]])
    found = [
        np.linalg.norm(position[i + 1 :] - position[i], axis=1) - radius[i + 1 :] - radius[i]
        for i in range(len(robots.radius))
    ]
    return np.concatenate(found)


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("axes: 2", 5),
        ("axes: 3", 6),
        ("robots: {count: 7}", 7),
        ("robots: {positions: [[5, 0], [-5, 0], [0, 5]]}", 3),
    ],
)
def test_count(text: str, count: int):
    scenario = parse_scenario(text)
    assert robot_count(scenario) == count
    assert team(scenario).position.shape == (count, scenario.axes)


def test_given_positions_and_overrides():
    robots = team(
        parse_scenario(
            """
            robots:
              positions: [[5, 0], [-5, 0], [0, 5]]
              mass: 2
              force_limit: null
              overrides:
                - {robot: 2, mass: 3, radius: 0.5, force_limit: 4}
                - {robot: 3, position: [0, 8]}
            """
        )
    )
    assert robots.position.tolist() == [[5, 0], [-5, 0], [0, 8]]
    assert robots.mass.tolist() == [2, 3, 2]
    assert robots.radius.tolist() == [0.2, 0.5, 0.2]
    assert robots.force_limit.tolist() == [np.inf, 4, np.inf]


@settings(max_examples=30)
@given(st.integers(0, 2**53 - 1), st.integers(2, 3), st.integers(1, 8), st.just(0.0) | st.floats(1e-9, 1.0))
def test_random_positions_keep_their_gaps_and_stay_inside(seed: int, axes: int, count: int, gap: float):
    scenario = Scenario(
        seed=seed,
        axes=axes,
        robots={"count": count, "placement": {"within": 8.0, "least_gap": gap}},
        obstacles=({"position": (3.0,) * axes, "radius": 1.0},),
        mission={"behaviors": ("surface",)},
    )
    assert gaps(scenario).min() >= gap - 1e-12
    assert np.linalg.norm(team(scenario).position, axis=1).max() <= 8.0


def test_same_seed_same_places_other_seed_other_places():
    first, again, other = (team(Scenario(seed=seed)).position for seed in (4, 4, 5))
    assert np.array_equal(first, again)
    assert not np.isclose(first, other).any()


def test_random_positions_are_the_same_on_every_machine():
    assert team(Scenario(seed=1)).position[0].tolist() == [-5.097883951590014, -3.9873002097390753]


def test_a_place_of_ones_own_is_kept_clear():
    scenario = Scenario(
        robots={"count": 12, "overrides": ({"robot": 12, "position": (2.0, 0.0), "radius": 1.0},)},
        mission={"behaviors": ("surface",)},
    )
    assert team(scenario).position[11].tolist() == [2.0, 0.0]
    # From the target robot 12 stands 0.7 m, as told; everything that was drawn stands a meter off.
    assert np.sort(gaps(scenario))[0] == pytest.approx(0.7)
    assert np.sort(gaps(scenario))[1] >= 1.0


def test_uniform_in_the_ball():
    scenario = Scenario(
        robots={"count": 2000, "radius": 1e-3, "placement": {"within": 100.0, "least_gap": 0.0}},
        target={"radius": 1e-3},
    )
    distance = np.linalg.norm(team(scenario).position, axis=1) / 100.0
    assert np.mean(distance**2) == pytest.approx(0.5, abs=0.02)


def test_no_room():
    with pytest.raises(ScenarioError) as caught:
        team(Scenario(robots={"count": 50, "placement": {"within": 2.0}}))
    (fault,) = caught.value.faults
    assert fault.key == "robots.placement"
    assert "within 2 m" in fault.message
