"""Wind from a file: between the points of the grid, beyond them, in time; and wrong files."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import escort_mj
from escort_mj.components.grid import Grid
from escort_mj.components.mission import axis_names
from escort_mj.conformance.stand import Stand
from escort_mj.disturbances.wind_field import WindField
from escort_mj.errors import ScenarioError
from escort_mj.mission.batch import fly_many
from escort_mj.scenario import dump_scenario
from escort_mj.scenario.schema.scenario import Scenario

RANDOM = np.random.default_rng(11)
POINTS = [np.array(x) for x in ([-3.0, -1.0, 0.5, 4.0], [-2.0, 3.0], [0.0, 1.0, 5.0], [-1.0, 1.0])]
TIMES = np.array([1.0, 2.0, 5.0])
RADIUS = Scenario().robots.radius


def arrays(axes: int, timed: bool = False) -> dict[str, Any]:
    """What a file has, with velocities at random."""
    points = POINTS[:axes]
    found = dict(zip(axis_names(axes), points, strict=True)) | ({"time": TIMES} if timed else {})
    shape = (*[len(TIMES)] * timed, *map(len, points), axes)
    return found | {"velocity": RANDOM.normal(size=shape)}


def between(found: dict[str, Any], time: float, place: Any) -> Any:
    """Velocity at a place: along one axis after the other, as NumPy interpolates."""
    velocity, axes = found["velocity"], [found[name] for name in axis_names(len(place))]
    ways = [*([(time, found["time"])] if "time" in found else []), *zip(place, axes, strict=True)]
    for x, points in ways:
        flat = velocity.reshape(len(points), -1)
        columns = [np.interp(x, points, column) for column in flat.T]
        velocity = np.reshape(columns, velocity.shape[1:])
    return velocity


def wind(found: dict[str, Any], time: float, places: Any, **keys: Any) -> Any:
    """What robots at rest feel, from their drag."""
    axes = places.shape[1]
    grid = Grid(
        time=tuple(found.get("time", ())),
        points=tuple(tuple(found[name]) for name in axis_names(axes)),
        velocity=tuple(found["velocity"].ravel()),
    )
    stand = Stand(WindField(grid=grid, **keys), Scenario, len(places), axes)
    stand.state.time[0], stand.state.q[:], stand.state.v[:] = time, places, 0.0
    stand.call()
    force = stand.state.disturbance_force
    size = np.linalg.norm(force, axis=-1, keepdims=True)
    return force / np.sqrt(np.maximum(size, 1e-300) * 0.5 * 1.2 * 0.47 * np.pi * RADIUS**2)


@pytest.mark.parametrize("timed", [False, True])
@pytest.mark.parametrize("axes", [2, 3, 4])
def test_between_points_it_is_linear_along_each_axis(axes: int, timed: bool) -> None:
    found = arrays(axes, timed)
    low, high = (np.array([x[k] for x in POINTS[:axes]]) for k in (0, -1))
    places = low + (high - low) * RANDOM.random((11, axes))
    places[0], places[1] = low, high
    for time in (0.0, 1.3, 4.0, 9.0) if timed else (3.0,):
        expected = [between(found, time, place) for place in places]
        np.testing.assert_allclose(wind(found, time, places), expected, atol=1e-12)


def test_outside_it_is_calm_or_that_of_the_boundary() -> None:
    found = arrays(2)
    places = np.array([[-3.1, 0.0], [0.0, 3.5], [9.0, -9.0], [1.0, 1.0]])
    held = np.array([between(found, 0.0, place) for place in places])  # NumPy holds, too
    np.testing.assert_allclose(wind(found, 0.0, places, outside="nearest"), held, atol=1e-12)
    calm = wind(found, 0.0, places)
    assert np.abs(calm[:3]).max() == 0.0
    np.testing.assert_allclose(calm[3], held[3], atol=1e-12)


TEXT = """
duration: 2
expect: []
uncertainty:
  disturbances:
    - {disturbance: wind_field, grid: wind.npz, outside: nearest}
    - {disturbance: wind_field, grid: other.npz}
"""


def written(folder: Path, text: str = TEXT, **changed: Any) -> Path:
    one, other = arrays(2, timed=True) | changed, arrays(2)
    for name, found in (("wind", one), ("other", other)):
        np.savez(folder / f"{name}.npz", **{key: x for key, x in found.items() if x is not None})
    (folder / "mission.yaml").write_text(text)
    return folder / "mission.yaml"


def test_a_mission_has_the_winds_of_its_files_and_keeps_them(compiled: None, tmp_path: Path) -> None:
    scenario = escort_mj.load_scenario(written(tmp_path))
    files = [dict(np.load(tmp_path / f"{name}.npz")) for name in ("wind", "other")]
    (flight,) = fly_many([scenario], 1, traces=True)
    trace = flight.trace
    q, v = trace["q"].values, trace["v"].values
    for step in range(0, len(q), 7):
        force = np.zeros_like(q[step])
        for found, outside in zip(files, ("nearest", "calm"), strict=True):
            for i, place in enumerate(q[step]):
                inside = -3.0 <= place[0] <= 4.0 and -2.0 <= place[1] <= 3.0
                known = inside or outside == "nearest"
                air = between(found, float(trace["time"][step]), place) if known else np.zeros(2)
                relative = air - v[step, i]
                force[i] += 0.5 * 1.2 * 0.47 * np.pi * RADIUS**2 * np.linalg.norm(relative) * relative
        np.testing.assert_allclose(trace["disturbance"].values[step], force, atol=1e-12)
    (tmp_path / "wind.npz").unlink()
    (tmp_path / "again.yaml").write_text(dump_scenario(scenario))
    assert escort_mj.load_scenario(tmp_path / "again.yaml") == scenario


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "no_velocity": (
        {"velocity": None},
        "wind.npz: found time, x, y; expected the arrays x, y and so on, vel",
    ),
    "other_names": ({"u": np.ones(3)}, "wind.npz: found time, u, velocity, x, y; expected the arrays x, y"),
    "shape": (
        {"velocity": np.ones((3, 4, 3, 2))},
        r"wind.npz: velocity: found the shape \(3, 4, 3, 2\); exp",
    ),
    "axes": ({"velocity": np.ones((4, 2, 2))}, "wind.npz: velocity: found float64 of the shape .*4 axes"),
    "not_finite": ({"x": np.array([0.0, 1.0, 2.0, np.nan])}, "wind.npz: x: found float64.*expected finite"),
    "order": ({"x": np.array([0.0, 2.0, 1.0, 3.0])}, "wind.npz: x: found 1 after 2; expected increasing"),
    "times": ({"time": np.array([0.0, 1.0, 1.0])}, "wind.npz: time: found 1 after 1; expected increasing"),
    "one": ({"y": np.zeros(1), "velocity": np.ones((3, 4, 1, 2))}, "wind.npz: y: found 1 points; expected 2"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_file_is_one_error(tmp_path: Path, case: str) -> None:
    changed, words = WRONG[case]
    with pytest.raises(ScenarioError, match=words) as raised:
        escort_mj.load_scenario(written(tmp_path, **changed))
    assert [fault.key for fault in raised.value.faults] == ["uncertainty.disturbances[0].grid"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (TEXT.replace("wind.npz", "none.npz"), "none.npz: there is no such file"),
        (TEXT.replace("wind.npz", "wind.csv"), "wind.csv: a grid is a table, or the name of a file"),
        (TEXT.replace("grid: wind.npz, ", ""), r"\[0\].grid: found none; give the name of a .npz file"),
        ("axes: 3\ntarget: {position: [0, 0, 0]}" + TEXT, r"\[0\].grid: found 2 axes; expected 3, as axes"),
        (
            TEXT.replace("wind.npz", "{points: [[0, 1], [0, 1]], velocity: [1]}"),
            "found 1 numbers; expected 8",
        ),
    ],
)
def test_a_wrong_key_is_told_with_its_place(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        escort_mj.load_scenario(written(tmp_path, text))
