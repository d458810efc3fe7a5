"""What one team has of a mission with several: its own metrics and verdicts, from true positions."""

import numpy as np
import pytest

from escort_mj import Run, Scenario, run
from escort_mj.metrics.spacing import spacing_error
from escort_mj.record.team import of_team, team_names

CHANGE, LOSS = 2.0, 4.0
TEAMS = (
    {"name": "one", "robots": (1, 2, 3, 7), "radius": 2.0, "demand": ({"robots": 3},),
     "targets": ({"name": "a", "position": ("0.3*t", 4.0), "radius": 0.2},)},
    {"name": "two", "robots": (4, 5, 6), "radius": 2.5, "demand": ({"after": CHANGE, "robots": 4},),
     "targets": ({"name": "b", "position": (0.0, -4.0), "radius": 0.3},
                 {"name": "c", "position": (0.5, "-4 + 0.1*t"), "radius": 0.2})},
)  # fmt: skip


@pytest.fixture(scope="module")
def flown() -> Run:
    """Seven robots: one changes over at 2 s, and one is lost at 4 s."""
    return run(
        Scenario(
            duration=6.0, target=None, teams=TEAMS, recording={"rate": 100},
            robots={"count": 7, "force_limit": 50.0, "failures": ({"robot": 5, "at": LOSS, "notice": 0.0},)},
            mission={"max_speed": 2.0, "behaviors": (
                {"behavior": "avoid_obstacles", "safe_distance": 0.3}, "vertices", "surface",
            )},
            expect=(
                {"metric": "radius_error_max", "team": "one", "at_most": 10.0},
                {"metric": "radius_error_max", "team": "two", "at_most": 1e-6, "after": 5.0},
                {"settled": 10.0, "by": 5.0, "team": "two"},
            ),
        )
    )  # fmt: skip


def errors(flown: Run, name: str) -> np.ndarray:
    """Radius errors of the members of a team, by hand; NaN for all other robots."""
    trace, time = flown.trace, flown.trace["time"].values
    q, place = trace["q"].values, trace["obstacle_position"].values
    team = {"one": 1, "two": 2}[name]
    center = place[:, 0] if team == 1 else 0.5 * (place[:, 1] + place[:, 2])
    member = (trace["member_of"].values == team) & (trace["lost"].values == 0)
    error = np.abs(np.linalg.norm(q - center[:, None], axis=2) - {"one": 2.0, "two": 2.5}[name])
    assert len(time) == len(error)
    return np.where(member, error, np.nan)


def test_who_is_in_which_team(flown: Run) -> None:
    trace, time = flown.trace, flown.trace["time"].values
    assert team_names(trace) == ["one", "two"] and (trace["obstacle_team"].values == [1, 2, 2]).all()
    count = (trace["member_of"].values == 2).sum(axis=1)
    assert count[time < CHANGE - 0.005].tolist() == [3] * int((time < CHANGE - 0.005).sum())
    assert set(count[time > CHANGE + 0.005]) == {4}  # one has no other to spare, when 5 is lost
    assert trace["member_of"].values[0].tolist() == [1, 1, 1, 2, 2, 2, 1]
    assert np.allclose(
        trace["team_center"].values[:, 1], trace["obstacle_position"].values[:, 1:].mean(axis=1)
    )


@pytest.mark.parametrize("name", ["one", "two"])
def test_metrics_of_each_team_are_recomputed(flown: Run, name: str) -> None:
    error, time = errors(flown, name), flown.trace["time"].values
    tail = time >= 0.8 * time[-1] - 1e-9
    assert flown.values[f"{name}.radius_error_max"] == pytest.approx(np.nanmax(error[tail]), rel=1e-12)
    mean = np.nanmean(error[tail])  # of even samples
    assert flown.values[f"{name}.radius_error_mean"] == pytest.approx(mean, rel=1e-2)
    part = of_team(flown.trace, name)
    assert part.attrs["mission_radius"] == {"one": 2.0, "two": 2.5}[name]
    assert part.attrs["target_radius"] == {"one": 0.2, "two": 0.3}[name]
    assert np.array_equal(part["lost"].values == 0, ~np.isnan(error))
    kept = np.isnan(spacing_error(part)).all(axis=1)  # members change: that is another formation
    assert np.array_equal(kept, time > CHANGE - 0.005) and len(part["neighbors"].values)
    assert np.isnan(flown.values["radius_error_max"])


def test_every_verdict_is_of_its_team(flown: Run) -> None:
    found = {verdict.metric: verdict for verdict in flown.verdicts}
    assert list(found) == ["outcome", "one.radius_error_max", "two.radius_error_max", "two.settled"]
    largest = float(np.nanmax(errors(flown, "one")))  # of the samples; the verdict is that of all steps
    assert largest <= found["one.radius_error_max"].value < largest + 0.01
    late = flown.trace["time"].values >= 5.0 - 1e-9
    two = float(np.nanmax(errors(flown, "two")[late]))
    for name, bound in (("two.radius_error_max", 1e-6), ("two.settled", 10.0)):
        assert two <= found[name].value < two + 1e-3
        assert found[name].passed == (two <= bound)


def test_a_team_has_the_targets_and_the_radius_of_the_moment() -> None:
    """The second team gives a target to the first at 1 s, and comes nearer; the gift is the larger one."""
    one, two = ({**team, "demand": ()} for team in TEAMS)
    b, c = two["targets"]  # type: ignore[misc]
    b = {**b, "position": (0.0, 2.5), "escorted_by": ({"after": 1.0, "team": "one"},)}
    two = {**two, "radius": 4.5, "radii": ({"after": 1.0, "radius": 1.5},)}
    two["targets"] = (b, {**c, "radius": 0.1})
    flown = run(Scenario(
        duration=2.0, target=None, teams=({**one, "radius": 2.5}, two), recording={"rate": 100},
        robots={"count": 7}, mission={"behaviors": ("vertices", "surface")},
    ))  # fmt: skip
    trace, late = flown.trace, flown.trace["time"].values > 0.9999
    assert np.array_equal(trace["obstacle_team"].values, np.where(late[:, None], [1, 1, 2], [1, 2, 2]))
    place = trace["obstacle_position"].values
    for name, first, then, radii in (
        ("one", place[:, 0], 0.5 * (place[:, 0] + place[:, 1]), (2.5, 2.5)),
        ("two", 0.5 * (place[:, 1] + place[:, 2]), place[:, 2], (4.5, 1.5)),
    ):
        part = of_team(trace, name)
        center = np.where(late[:, None], then, first)
        assert np.allclose(part["target_position"].values, center, rtol=0.0, atol=1e-15)
        robots = np.array({"one": (1, 2, 3, 7), "two": (4, 5, 6)}[name]) - 1
        error = np.linalg.norm(trace["q"].values[:, robots] - center[:, None], axis=2)
        error -= np.where(late, radii[1], radii[0])[:, None]
        tail = trace["time"].values >= 1.6 - 1e-9
        assert flown.values[f"{name}.radius_error_max"] == pytest.approx(np.abs(error[tail]).max(), rel=1e-12)
        assert part.attrs["target_radius"] == 0.3 - 0.0 * len(robots)
        ends = part["neighbors"].values - 1
        apart = np.linalg.norm(np.diff(trace["q"].values[:, ends], axis=2)[:, :, 0], axis=2)
        even = part["spacing"].values * np.where(late, radii[1], radii[0])[:, None] / radii[0]
        assert np.allclose(spacing_error(part), apart - even, rtol=0.0, atol=1e-12)


def test_teams_that_keep_their_members_have_their_neighbors() -> None:
    fixed = tuple({**team, "demand": ()} for team in TEAMS)
    trace = run(
        Scenario(duration=0.1, target=None, teams=fixed, robots={"count": 7}, mission={"behaviors": (
            {"behavior": "avoid_obstacles", "safe_distance": 0.3}, "vertices", "surface",
        )})
    ).trace  # fmt: skip
    for name, robots, radius in (("one", {1, 2, 3, 7}, 2.0), ("two", {4, 5, 6}, 2.5)):
        part = of_team(trace, name)
        assert {*part["neighbors"].values.ravel().tolist()} == robots
        side = 2.0 * radius * np.sin(np.pi / len(robots))
        assert np.allclose(part["spacing"].values, side)
