"""Forces that the controller does not know: they add up, depend on q and v, and keep memory of their own."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import escort_mj
from escort_mj.conformance import check_plugin
from escort_mj.errors import ScenarioError
from escort_mj.mission.batch import fly_many
from tests.plugged import COMPILED, plugin

FIELD, _ = plugin("disturbance")
SHORT = {"duration": 1.0, "expect": [], "uncertainty": {}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Hold the same field as a plugin that is compiled, and as one that is not."""
    made = tmp_path_factory.mktemp("fields")
    (made / "swirl.py").write_text(FIELD + COMPILED)
    (made / "plain.py").write_text(FIELD.replace('"swirl"', '"plain"'))
    return made


def mission(folder: Path, *disturbances: Any, **more: Any) -> Any:
    plugins = [str(folder / "swirl.py"), str(folder / "plain.py")]
    keys = SHORT | {"plugins": plugins, "uncertainty.disturbances": list(disturbances)} | more
    return escort_mj.load_scenario("main", keys)


def trace_of(scenario: Any) -> Any:
    (flight,) = fly_many([scenario], 1, traces=True)
    assert flight.outcome.good, flight.message
    return flight.trace


def swirl(trace: Any, gust: str | None = None) -> np.ndarray:
    """What the field is at recorded places and velocities."""
    q, v = trace["q"].values, trace["v"].values
    force = 0.3 * np.stack([-q[..., 1], q[..., 0]], axis=-1)
    force -= 0.2 * np.linalg.norm(v, axis=-1, keepdims=True) * v
    return force + (0.0 if gust is None else trace["component_memory"].sel(memory=gust).values)


def test_functions_of_time_add_up(compiled: None) -> None:
    forces = [
        {"disturbance": "expressions", "per_axis": ["t", 1]},
        {"disturbance": "expressions", "per_axis": [0, "t**2"]},
    ]
    keys = SHORT | {"uncertainty": {"disturbance": ["2*sin(t)", 3], "disturbances": forces}}
    trace = trace_of(escort_mj.load_scenario("main", keys))
    t = trace["time"].values
    expected = np.stack([2.0 * np.sin(t) + t, 4.0 + t**2], axis=-1)
    np.testing.assert_allclose(
        trace["disturbance"].values, np.repeat(expected[:, None], 5, axis=1), rtol=1e-13
    )
    assert "component_memory" not in trace


@pytest.mark.parametrize("name", ["swirl", "plain"])
def test_a_field_is_what_its_equation_says_and_adds_to_others(
    compiled: None, folder: Path, name: str
) -> None:
    trace = trace_of(mission(folder, {"disturbance": name}, **{"uncertainty.disturbance": [1, "t"]}))
    others = np.stack([np.ones_like(trace["time"]), trace["time"].values], axis=-1)[:, None]
    np.testing.assert_allclose(trace["disturbance"].values, swirl(trace, f"{name}.gust") + others, atol=1e-12)
    assert str(trace["memory_unit"].sel(memory=f"{name}.gust").values) == "N"
    assert float(np.abs(trace["component_memory"]).max()) > 1e-3


def test_both_forms_agree(compiled: None, folder: Path) -> None:
    one, other = (trace_of(mission(folder, name)) for name in ("swirl", "plain"))
    for name in ("q", "disturbance"):
        np.testing.assert_allclose(one[name].values, other[name].values, atol=1e-10)
    assert float(np.abs(one["disturbance"]).max()) > 1.0


def test_each_has_memory_and_random_numbers_of_its_own(compiled: None, folder: Path) -> None:
    trace = trace_of(mission(folder, "swirl", "swirl"))
    first, second = (
        trace["component_memory"].sel(memory=name).values for name in ("swirl.gust", "swirl_2.gust")
    )
    assert abs(np.corrcoef(first[-1].ravel(), second[-1].ravel())[0, 1]) < 0.9
    total = 2.0 * swirl(trace) + first + second
    np.testing.assert_allclose(trace["disturbance"].values, total, atol=1e-12)
    again = trace_of(mission(folder, "swirl", "swirl", seed=7))["component_memory"].values
    assert not np.allclose(again[-1], trace["component_memory"].values[-1])


def test_snapshots_go_on_with_the_same_bits(compiled: None, folder: Path) -> None:
    live = escort_mj.start(mission(folder, "swirl")).step(0.2)
    then = live.snapshot()
    first = live.step(0.3)["disturbance"].copy()
    live.push(1, [9.0, 0.0])
    assert live.step(0.3)["disturbance"].tobytes() != first.tobytes()
    live.restore(then)
    assert live.step(0.3)["disturbance"].tobytes() == first.tobytes()


@pytest.mark.slow
def test_a_compiled_plugin_passes_all_checks(compiled: None, hurried: None, folder: Path) -> None:
    rows = list(check_plugin(str(folder / "swirl.py")))
    assert not [row for row in rows if not row.held]
    assert {"forms agree", "robot by robot", "same bits"} <= {row.name for row in rows}


@pytest.mark.parametrize(
    ("disturbances", "words"),
    [
        ([{"disturbance": "gale"}], r"disturbances\[0\].*gale.*expressions"),
        ([{"disturbance": "expressions", "per_axis": ["t"]}], r"per_axis: found 1 numbers; expected 2"),
        ([{"disturbance": "expressions"}], r"per_axis: found 0 numbers; expected 2"),
        ([{"disturbance": "expressions", "per_axis": ["t", "sin(x)"]}], r"per_axis\[1\].*x"),
        (
            [{"disturbance": "expressions", "per_axis": ["t", "1/(t-0.5)"]}],
            r"per_axis\[1\]: has no finite value",
        ),
        ([{"disturbance": "expressions", "force": ["t", 1]}], "force"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(disturbances: list[Any], words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        escort_mj.load_scenario("main", SHORT | {"uncertainty": {"disturbances": disturbances}})
