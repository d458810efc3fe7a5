"""A half-space that robots never enter: in all outer loops, in plane and space, without chatter."""

import inspect
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import escort_mj
from escort_mj import Run, ScenarioError, load_scenario
from escort_mj.behaviors.boundary import Boundary
from escort_mj.errors import EscortError
from escort_mj.report.figures.paths import bounds
from tests.report.figures.test_knowledge import drawn, words

EDGE = 3.2  # m along the first axis; the team's sphere around the target goes beyond it
EXACT = {"sensing": {}, "uncertainty": {}}
BORDER = {"behavior": "border", "normal": [-1.0, 0.0]}


def flown(name: str, outer: str, boundary: bool, changes: dict, overrides: tuple[str, ...] = ()) -> Run:
    scenario = load_scenario(name, ["duration=10", "expect=[]", f"mission.outer={outer}", *overrides])
    first, *others = np.eye(scenario.axes)
    table = {"behavior": "boundary", "point": (EDGE * first).tolist(), "normal": (-first).tolist()}
    behaviors = [{"behavior": "avoid_obstacles", "safe_distance": 0.4}, "vertices", "surface"]
    if boundary:
        behaviors.insert(0, table)
    return escort_mj.run(scenario.replace({"mission.behaviors": behaviors, **changes}))


@pytest.mark.crossed
@pytest.mark.parametrize("outer", ["nsb", "set_based", "barrier_filter", "potential_field"])
@pytest.mark.parametrize("name", ["main", "main_3d"])
@pytest.mark.parametrize("changes", [{}, EXACT], ids=["noise", "exact"])
def test_robots_stay_on_their_side(compiled: None, name: str, outer: str, changes: dict) -> None:
    run = flown(name, outer, True, changes)
    assert run.outcome == "completed"
    assert run.trace["q"].values[..., 0].max() < EDGE
    free = flown(name, outer, False, changes)
    assert free.trace["q"].values[..., 0].max() > EDGE + 1.0  # they would have gone there


@pytest.mark.parametrize("outer", ["nsb", "set_based"])
def test_nothing_chatters_at_the_boundary(compiled: None, outer: str) -> None:
    """Without noise, robots come to the boundary and stay: velocities have no steps and hardly turn round."""
    run = flown("main", outer, True, EXACT, ("recording.rate=250",))
    gap = EDGE - run.trace["q"].values[..., 0]
    last = run.trace["time"].values > 5.0
    there = [i for i in range(gap.shape[1]) if (gap[last, i] < 0.5).all()]
    assert there  # some robots are held there
    for i in there:
        along = run.trace["v_d"].values[last, i, 0]
        steps = np.diff(along)
        turns = int((np.diff(np.sign(steps[np.abs(steps) > 1e-6])) != 0).sum())
        assert turns <= 5 and np.abs(steps).max() < 0.02


def test_a_boundary_above_is_kept_before_what_is_below(compiled: None) -> None:
    """Its row of the null space: below it, tasks lose their part along the normal and keep the rest."""
    run = flown("main", "nsb", True, EXACT)
    q, v = run.trace["q"].values, run.trace["v_d"].values
    speed = 2.0 * (EDGE - 0.1 - run.scenario.robots.radius - q[..., 0])
    assert (v[..., 0] <= speed + 1e-9).all()


@pytest.mark.parametrize("outer", ["nsb", "potential_field"])
def test_its_wish_is_what_took_the_place_of_others(compiled: None, outer: str) -> None:
    """Inside its bound a robot is held, too: that is recorded, and it is 2 h along the normal."""
    trace = flown("main", outer, True, EXACT).trace
    place = trace["behavior"].values.tolist().index("boundary")
    wish, along = trace["task_wish"].values[..., place], trace["v_d"].values[..., 0]
    h = EDGE - 0.1 - trace["q"].values[..., 0] - load_scenario("main").robots.radius
    held = wish > 0.0
    assert held.sum() > 100 and (h[held] > 0.0).any() and not held.all()
    np.testing.assert_allclose(wish[held], 2.0 * np.abs(h[held]), atol=1e-9)
    np.testing.assert_allclose(along[held], 2.0 * h[held], atol=1e-9)
    assert (along[~held & (h > 0.0)] <= 2.0 * h[~held & (h > 0.0)] + 1e-9).all()
    assert (trace["task_error"].values[..., place][h > 1e-6] == 0.0).all()


def test_its_text_is_a_plugin_with_the_same_bits(compiled: None, tmp_path: Path) -> None:
    ours = Path(inspect.getfile(Boundary)).read_text()
    text = re.sub(r"from escort_mj\.[a-z_.]+ import", "from escort_mj.plugins import", ours)
    text = text.replace('"boundary"', '"border"').replace("class Boundary", "class Border")
    text = text.replace("    limits:", "    compiled: ClassVar[bool] = True\n    limits:")
    (plugin := tmp_path / "border.py").write_text(text)
    found = []
    for name in ("boundary", "border"):
        table = {"behavior": name, "point": [EDGE, 0.0], "normal": [-1.0, 0.0]}
        keys = ["duration=3", "expect=[]", "mission.outer=set_based"]
        scenario = load_scenario("main", keys, [str(plugin)])
        run = escort_mj.run(scenario.replace({"mission.behaviors": [table, "vertices", "surface"]}))
        found.append(run.trace["q"].values)
    assert np.array_equal(*found) and found[0][..., 0].max() > EDGE - 0.5


@pytest.mark.parametrize("axes", [2, 3])
def test_pictures_show_it_with_its_name(compiled: None, axes: int) -> None:
    run = flown("main" if axes == 2 else "main_3d", "nsb", True, EXACT, ("duration=2", "expect=[]"))
    assert run.trace["border"].values.tolist() == ["boundary"]
    assert run.trace["border_point"].values.tolist() == [[EDGE, *[0.0] * (axes - 1)]]
    assert "boundary" in words(drawn(run.trace, "paths"))
    low, high = bounds(run.trace)
    far = run.trace.assign(border_point=run.trace["border_point"] + 10.0 * (high - low))
    assert "boundary" not in words(drawn(far, "paths"))


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ("return 3", "border returned 3; expected a Plane, or None"),
        ("return Plane((0.0, 1.0), (0.0, 0.0))", "expected a normal that is not 0"),
        ("return Plane((0.0,), (1.0,))", "the mission has 2 axes"),
        ("return Plane((0.0, np.nan), (1.0, 0.0))", "point: found nan; expected a finite number"),
        ("return Plane(0.0, 1.0)", "border.py:.*TypeError"),
    ],
)
def test_what_a_plugin_says_of_its_border_is_looked_at(tmp_path: Path, told: str, said: str) -> None:
    text = inspect.getsource(sys.modules[Boundary.__module__]).replace('"boundary"', '"border"')
    text = "import numpy as np\n" + text.replace("return Plane(self.point, self.normal)", told)
    (plugin := tmp_path / "border.py").write_text(text)
    table = BORDER | {"point": [EDGE, 0.0]}
    scenario = load_scenario("main", ["duration=1", "expect=[]"], [str(plugin)])
    with pytest.raises(EscortError, match=said):
        escort_mj.run(scenario.replace({"mission.behaviors": [table, "vertices", "surface"]}))


def test_a_vector_may_have_no_default_and_then_has_to_be_given(tmp_path: Path) -> None:
    ours = Path(inspect.getfile(Boundary)).read_text().replace('"boundary"', '"border"')
    (plugin := tmp_path / "border.py").write_text(ours.replace("point: Vector", "point: Vector = (9.0, 0.0)"))
    scenario = load_scenario("main", [], [str(plugin)])
    (made,) = scenario.replace({"mission.behaviors": [BORDER]}).mission.behaviors
    assert made.point == (9.0, 0.0)
    with pytest.raises(ScenarioError, match=r"mission\.behaviors\[0\]\.normal: is missing"):
        scenario.replace({"mission.behaviors": ["border"]})
    with pytest.raises(ScenarioError, match=r"mission\.behaviors\[0\]\.point: found 2 numbers; expected 3"):
        load_scenario("main_3d", {"mission.behaviors": [BORDER | {"normal": [1.0, 0.0, 0.0]}]}, [str(plugin)])


def test_its_vectors_have_a_number_for_each_axis() -> None:
    table = {"behavior": "boundary", "point": [0.0, 0.0, 0.0], "normal": [1.0, 0.0]}
    with pytest.raises(ScenarioError, match=r"mission\.behaviors\[0\]\.point: found 3 numbers; expected 2"):
        load_scenario("main").replace({"mission.behaviors": [table]})


def test_a_task_of_two_functions_that_is_not_active_leaves_all() -> None:
    from escort_mj.behaviors.task import both, keep_distance, leave, only
    from escort_mj.native.vectors import Vec

    x, y, w = (Vec(tuple(np.random.default_rng(k).normal(size=(3, 8)))) for k in range(3))
    asked = both(keep_distance(x, 1.0, 0.8), keep_distance(y, 1.0, 0.8))
    for condition, changed in ((np.full(8, False), False), (np.full(8, True), True)):
        left = leave(only(condition, asked), w)
        assert np.allclose(np.array(left.parts), np.array(w.parts)) != changed


def test_a_motion_that_is_not_active_asks_nothing() -> None:
    from escort_mj.behaviors.task import leave, move
    from escort_mj.native.vectors import Vec

    w = Vec(tuple(np.random.default_rng(1).normal(size=(3, 8))))
    active = np.arange(8) % 2.0
    asked = move(w, active, np.zeros(8))
    for velocity, left, own in zip(asked.velocity.parts, leave(asked, w).parts, w.parts, strict=True):
        assert np.array_equal(velocity, active * own) and np.array_equal(left, (1.0 - active) * own)
