"""The controller without the simulator: the same law, bit for bit, and nothing wrong passes silently."""

import copy
import io
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from escort_mj import Controller, Limits
from escort_mj.api import load_scenario
from escort_mj.errors import EscortError, UsageError
from escort_mj.standalone.backend import CONTROL_SIGNALS
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant
from tests.world.test_twin_loop import MISSIONS

BLOCKED = {
    "robots": {"positions": [[4, 0.9], [1, 4], [-3, 2], [-3, -2]], "force_limit": 20},
    "obstacles": [
        {"shape": "box", "size": [0.5, 0.3], "position": [3, 0.2], "orientation": 0.4},
        {"motion": {"position": ["-0.5*t", 4]}, "body": {"mass": 2}},
    ],
    "mission": {"radius": 2.5, "max_speed": 2.0},
    "controller": {"law": "computed_torque"},
}
FAST = {
    "robots": {"positions": [[4, 0.9], [1, 4], [-3, 2], [-3, -2]], "force_limit": 20},
    "obstacles": [
        {"shape": "box", "size": [0.5, 0.3], "orientation": 0.4, "motion": {"position": ["1.5 + 3*t", 1.2]}},
        {"radius": 0.4, "motion": {"position": ["-1.5 - 4*t", 1.6]}},
        {"position": [-3.3, 3.1], "radius": 0.5},
        {"position": [-2.7, -2.9], "radius": 0.3},
        {"position": [-2.8, -1.1], "radius": 0.3},
    ],
    "mission": {
        "radius": 2.5, "max_speed": 1.0, "outer": "set_based",
        "behaviors": [{"behavior": "avoid_obstacles", "safe_distance": 0.8}, "vertices", "surface"],
    },
}  # fmt: skip
SPATIAL, SEEING = MISSIONS["spatial"], MISSIONS["seeing"]
LAWS_OF_TEAMS = {
    "target": None,
    "robots": {"positions": [[4, 0.9], [1, 4], [-3, 2], [17, -2], [23, 0], [16, 1]], "force_limit": 40},
    "teams": [
        {"name": "one", "robots": [1, 2, 3], "targets": [{"name": "a"}], "controller": "asmc",
         "demand": [{"after": 0.03, "robots": 4}]},
        {"name": "two", "robots": [4, 5, 6], "targets": [{"name": "b", "position": [20, "0.5*t"]}],
         "controller": "computed_torque"},
    ],
    "mission": {"radius": 2.5, "max_speed": 2.0},
}  # fmt: skip
FAILING = {
    "robots": {"count": 6, "failures": [{"robot": 2, "at": 1}, {"robot": 4, "at": 0.5, "kind": "stuck"}]}
}


def drive(controller: Controller, steps: int, **given: Any) -> list[dict[str, np.ndarray]]:
    """Point masses of its own, integrated as MuJoCo does; the signals of every call."""
    q, v, time, found = controller.start.copy(), np.zeros_like(controller.start), 0.0, []
    for _ in range(steps):
        force = controller(time, q, v, **given)
        signals = controller.signals
        found.append(signals)
        assert (signals["force"] == force).all()
        v = v + controller.timestep * (force + signals["disturbance"]) / controller.mass[:, None]
        q, time = q + controller.timestep * v, time + controller.timestep
    return found


@pytest.mark.parametrize(
    ("keys", "seconds"),
    [
        pytest.param("main", 5.0, marks=pytest.mark.slow),
        ("main", 1.0),
        (SPATIAL, 0.5),
        (SEEING, 0.5),
        (FAILING, 1.6),
    ],
    ids=["main_5_s", "main", "spatial", "sensors", "failures"],
)
def test_on_a_plant_of_its_own_it_is_the_mission(keys: Any, seconds: float, compiled: None) -> None:
    """Measured: no difference at all."""
    world, steps = build(load_scenario(keys)), round(seconds / 0.002)
    controller = Controller(keys, simulate=True)
    found = drive(controller, steps)
    with native_loop(world):
        plant = Plant(world)
        for signals in found:
            plant.step(1)
            for name in ("q", "v", "q_measured", "v_d", "tau", "force", "rho_hat", "target_position"):
                difference = np.abs(signals[name] - getattr(plant.state, name)).max()
                assert difference <= 1e-9, (name, difference)
    assert steps * 0.002 == pytest.approx(found[-1]["time"] + 0.002)


@pytest.mark.parametrize("keys", ["main", SPATIAL, SEEING, BLOCKED, FAST, FAILING, LAWS_OF_TEAMS])
def test_both_backends_agree(keys: Any) -> None:
    native, python = (Controller(keys, backend=name, simulate=True) for name in ("native", "interpreted"))
    random = np.random.default_rng(1)
    for step in range(12):
        q = native.start + random.normal(scale=0.1, size=native.start.shape)
        v = random.normal(size=q.shape)
        led = step % 3 and native.scenario.target is not None
        target = (random.normal(size=native.axes), random.normal(size=native.axes)) if led else None
        given: dict[str, Any] = {"target": target}
        if keys is BLOCKED:
            seen = random.normal(scale=3.0, size=(4, 2, 2))
            given |= {
                "obstacles": [[0.0, 4.0]] if step % 2 else None,
                "points": seen if step % 5 == 4 else None,
            }
            given |= {"mass": np.full(4, 1.5) if step % 2 else None, "bias": np.full((4, 2), 0.1)}
        time = 0.002 * (step + step // 10)  # with gaps
        forces = native(time, q, v, **given), python(time, q, v, **given)
        np.testing.assert_allclose(*forces, rtol=1e-12, atol=1e-10)
        one, other = native.signals, python.signals
        assert one.keys() == other.keys() == CONTROL_SIGNALS.keys() == native.units.keys()
        for name in one:
            np.testing.assert_allclose(one[name], other[name], rtol=0.0, atol=1e-10, err_msg=name)
            assert one[name].dtype == other[name].dtype
    assert (native.velocity == one["v_d"]).all()


def test_obstacles_are_seen_as_in_the_mission(compiled: None) -> None:
    """A box and a sphere that moves: the nearest points are found here, in the mission by MuJoCo."""
    world = build(load_scenario(BLOCKED))
    controller = Controller(BLOCKED)
    closest = np.inf
    with native_loop(world):
        plant = Plant(world)
        for _ in range(300):
            plant.step(1)
            state = plant.state
            tau = controller(state.time[0], state.q, state.v, obstacles=state.mover_position)
            np.testing.assert_allclose(tau, np.clip(state.command, -20.0, 20.0), rtol=0.0, atol=1e-6)
            closest = min(closest, state.obstacle_gap[:8:2].min())
    assert closest < 0.8, "avoidance has something to do"


def test_inside_a_shape_a_robot_is_pushed_out() -> None:
    controller = Controller(BLOCKED, {"obstacles.0.orientation": 0, "obstacles.0.position": [3, 0]})
    q = np.array([[3.45, 0.05], [1, 4], [-3, 2], [-3, -2]])
    controller(0.0, q, np.zeros((4, 2)))
    assert controller.velocity[0, 0] > 0.1 and controller.signals["avoidance_active"][0] == 1


@pytest.mark.slow_cases("interpreted")
@pytest.mark.parametrize("backend", ["native", "interpreted"])
def test_a_saved_state_continues_bit_for_bit(backend: Any) -> None:
    one, other = (Controller(SEEING, backend=backend, simulate=True) for _ in range(2))
    random = np.random.default_rng(2)
    inputs = [(0.002 * (k + k // 7), *random.normal(size=(2, 5, 2))) for k in range(20)]
    for each in inputs[:10]:
        one(*each)
    saved = one.snapshot()
    file = io.BytesIO()
    np.savez(file, **saved)
    file.seek(0)
    saved = dict(np.load(file))
    expected = [one(*each) for each in inputs[10:]]
    for _ in range(2):
        other.restore(saved)
        assert (np.array([other(*each) for each in inputs[10:]]) == expected).all()
    for wrong in ({}, {"clock": np.zeros(3)}, Controller("main_3d", backend="native").snapshot()):
        with pytest.raises(UsageError, match="^snapshot: "):
            other.restore(wrong)


def test_missed_timesteps_are_made_up_for() -> None:
    """On a straight line the measurements in between are exactly the interpolated ones."""
    every, some = Controller("main"), Controller("main")
    q, v = every.start, np.array([0.3, -0.2])
    for step in range(41):
        time = step * every.timestep
        force = every(time, q + time * v, np.broadcast_to(v, q.shape))
        if step % 4 == 0:
            seldom = some(time, q + time * v, np.broadcast_to(v, q.shape))
    np.testing.assert_allclose(seldom, force, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(some.signals["q_d"], every.signals["q_d"], rtol=0.0, atol=1e-12)


def test_jitter_does_not_add_up() -> None:
    """As many timesteps as have passed, whenever the calls come; the same call again changes nothing."""
    random, controller = np.random.default_rng(3), Controller("main")
    q, v = controller.start, np.zeros_like(controller.start)
    for time in 7.0 + np.concatenate([[0.0], np.sort(random.uniform(0.0, 0.2, 60)), [0.2]]):
        controller(time, q, v)
    assert controller.snapshot()["clock"].tolist() == [7.0, 7.2, 100]
    before = controller.signals
    assert (controller(7.2, q, v) == before["force"]).all()
    assert all(np.array_equal(controller.signals[name], before[name]) for name in before)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ({"time": 0.9}, "time: found 0.9 s after 1 s; time must not step back"),
        ({"time": 1.2}, "time: found 1.2 s after 1 s; allowed are at most 0.1 s"),
        ({"time": np.nan}, r"time: found NaN \(not a number\); expected a time"),
        ({"time": "now"}, 'time: found "now"; expected a time'),
        ({"positions": np.zeros((4, 2))}, r"positions: found the shape \(4, 2\); .*shape \(5, 2\)"),
        ({"positions": [[0, 1], [2]]}, "positions: found a list of 2; expected one row per robot"),
        ({"velocities": np.full((5, 2), np.nan)}, r"velocities: found nan at \[0, 0\]; every number"),
        ({"velocities": [[np.inf, 0]] * 5}, "velocities: found inf at"),
        ({"target": 3}, r"target: found 3; expected a pair \(position, velocity\)"),
        ({"target": ([1, 2, 3], [0, 0])}, r"position of the target: found the shape \(3,\)"),
        ({"obstacles": np.zeros((3, 2))}, r"obstacles: found the shape \(3, 2\); .*shape \(4, 2\)"),
        ({"points": np.zeros((5, 4, 2))}, "points: all obstacles are spheres"),
        ({"mass": [1, 2]}, r"mass: found the shape \(2,\)"),
        ({"mass": range(10**9)}, r"mass: found range\(0, 1000000000\); expected one mass per robot"),
        ({"bias": np.zeros(5)}, r"bias: found the shape \(5,\)"),
    ],
)
def test_wrong_input_is_one_clear_error_and_changes_nothing(call: dict, words: str) -> None:
    controller = Controller("main")
    q = controller.start
    good = {"time": 1.0, "positions": q, "velocities": np.zeros_like(q)}
    controller(**good)
    before = controller.snapshot()
    with pytest.raises(UsageError, match=f"^{words}"):
        controller(**good | {"time": 1.002} | call)
    assert all(
        np.array_equal(before[name], value, equal_nan=True) for name, value in controller.snapshot().items()
    )


def test_wrong_options_are_refused() -> None:
    with pytest.raises(UsageError, match='backend: found "fast"; expected native or interpreted'):
        Controller("main", backend="fast")  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="longest_gap: found 0; expected a number above 0"):
        Controller("main", longest_gap=0)
    with pytest.raises(UsageError, match='"taus" is not a signal of the controller; did you mean "tau"'):
        Controller("main").signals["taus"]
    with pytest.raises(UsageError, match="3 is not a signal of the controller"):
        Controller("main").signals[3]
    with pytest.raises(UsageError, match="robot: found 6; expected a number from 1 to 5"):
        Controller("main").robot(6)
    with pytest.raises(UsageError, match="RobotController: cannot be copied or pickled"):
        copy.copy(Controller("main").robot(1))


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_numbers_that_cannot_be_computed_with_are_refused() -> None:
    controller = Controller("main")
    q, v, far = controller.start, np.zeros((5, 2)), np.full((5, 2), 1e308)
    for name, arguments in {"positions": (far, v), "velocities": (q, -far), "mass": (q, v)}.items():
        more = {"mass": np.full((5, 2, 2), 1e308)} if name == "mass" else {}
        with pytest.raises(UsageError, match=f"{name}: found -?1e.308 at .*between -1e.10 and 1e.10"):
            controller(0.0, *arguments, **more)
    assert np.isfinite(controller(0.0, np.full((5, 2), 1e10), v)).all(), "all may be at the bound"
    limited = Controller("main", limits=Limits(age=1.0))
    limited(0.0, q, v)
    limited(0.002, np.where(np.arange(5)[:, None] == 2, 1e308, q), v)
    assert limited.ages.tolist() == [0.0, 0.0, 0.002, 0.0, 0.0], "no measurement, as infinity is none"


def test_a_law_without_a_finite_force_is_told() -> None:
    gains = {"law": "pd", "proportional_gain": 1e308, "derivative_gain": 1e308}
    controller = Controller("main", {"robots.force_limit": None, "controller": gains})
    q = controller.start
    controller(0.0, q, np.zeros_like(q))
    with pytest.raises(EscortError, match="no finite force for robot 1"):
        controller(0.002, q + 1e9, np.full_like(q, 1e9))


def test_a_plugin_that_fails_is_an_error(tmp_path: Path) -> None:
    plugin = tmp_path / "bad.py"
    plugin.write_text(
        "from typing import Literal\n"
        "from escort_mj.plugins import Law, Values\n"
        "class Bad(Law):\n"
        "    law: Literal['bad'] = 'bad'\n"
        "    def force(self, r: Values):\n"
        "        if r.time > 0.001: raise ValueError('it broke')\n"
        "        return r.s\n"
    )
    controller = Controller("main", {"controller": "bad"}, plugins=[str(plugin)])
    q = controller.start
    force = controller(0.0, q, np.zeros_like(q))
    assert (force == np.clip(controller.signals["s"], -10.0, 10.0)).all()
    with pytest.raises(
        EscortError, match="a plugin raised an error at 0.002 s: .*bad.py:6: ValueError: it broke"
    ):
        controller(0.002, q, np.zeros_like(q))


def test_a_team_that_starts_elsewhere_gets_a_formation_that_is_near() -> None:
    """Turned by a half, and about a target that is far from the scenario's: the same, turned and moved."""
    controller, away = Controller("main"), np.array([100.0, -50.0])
    begin = controller._surroundings.setup.target.position(0.0)
    still = np.zeros(2)
    far = {"obstacles": np.full((4, 2), 1e4)}
    first = controller(0.0, controller.start, np.zeros((5, 2)), (begin, still), **far)
    q = away - (controller.start - begin)
    controller.reset(q, away)
    turned = controller(123.0, q, np.zeros((5, 2)), (away, still), **far)
    np.testing.assert_allclose(turned, -first, atol=1e-9)


@pytest.mark.parametrize("keys", ["main", SPATIAL, {"mission": {"outer": "barrier_filter"}}])
def test_one_robot_gets_its_row(keys: Any) -> None:
    team = Controller(keys)
    robots = [team.robot(number + 1) for number in range(team.count)]
    random, q = np.random.default_rng(4), team.start
    for step in range(20):
        v = random.normal(size=q.shape)
        time, target = step * team.timestep, tuple(random.normal(size=(2, team.axes)))
        forces = team(time, q, v, target)
        for row, robot in enumerate(robots):
            heard = {other + 1: (q[other], v[other]) for other in range(team.count)}
            known = heard if row % 2 else np.stack([q, v])
            assert (robot(time, q[row], v[row], known, target) == forces[row]).all()
            assert (robot.velocity == team.velocity[row]).all()
        q = q + team.timestep * v
    saved = robots[0].snapshot()
    heard = robots[0](time + 0.002, q[0], v[0])  # of nobody: they are where they were
    robots[0].restore(saved)
    assert (robots[0](time + 0.002, q[0], v[0], q - team.timestep * v) == heard).all()
    with pytest.raises(UsageError, match="teammates: found 0; expected numbers of robots, from 1 to"):
        robots[0](time, q[0], v[0], {0: q[0]})
    with pytest.raises(
        UsageError, match=r"position: found the shape \(3,\)" if team.axes == 2 else "position"
    ):
        robots[0](time, [0.0, 1.0, 2.0][: 5 - team.axes], v[0])


def test_a_process_that_drives_robots_imports_no_simulator() -> None:
    program = """
import sys
from escort_mj import Controller
controller = Controller("patrol")
force = controller(0.0, controller.start, 0.0 * controller.start)
controller.robot(2)(0.0, controller.start[1], [0, 0], {1: controller.start[0]})
controller.signals["s"], controller.velocity, controller.snapshot()
unwanted = {"mujoco", "dm_control", "numba", "pandas", "xarray", "h5py", "matplotlib", "rich"}
print(force.shape, sorted({name.split(".")[0] for name in sys.modules} & unwanted))
"""
    found = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    assert found.stdout == "(5, 2) []\n"
