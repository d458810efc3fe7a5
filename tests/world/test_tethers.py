"""Tethers: springs and cables between bodies, against closed forms; what is wrong with them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import escort_mj
from escort_mj.errors import ScenarioError
from escort_mj.scenario.reader.load import scenario_of

MASSES = (1.0, 3.0)


def pulled(seconds: float, apart: float = 2.0, speed: float = 0.0, **tether: Any) -> escort_mj.Run:
    """Two robots without any force but that of a tether, the second of which leaves the first."""
    scenario = escort_mj.Scenario(
        duration=seconds,
        target=None,
        recording={"rate": 500},
        robots={
            "positions": [[0.0, 0.0], [apart, 0.0]],
            "velocities": [[0.0, 0.0], [speed, 0.0]],
            "overrides": [{"robot": i, "mass": mass} for i, mass in enumerate(MASSES, 1)],
            "tethers": [{"between": [1, 2], **tether}],
        },
        mission={"behaviors": ["avoid_obstacles"]},
        physics={"timestep": 1e-3},
    )
    mission = escort_mj.start(scenario, command="force")
    mission.command(np.zeros((2, 2)))
    mission.step(seconds)
    return mission.run()


def distance(run: escort_mj.Run) -> np.ndarray:
    """Of the two robots, shape (T,) [m]."""
    q = run.trace["q"].values
    return np.asarray(np.linalg.norm(q[:, 1] - q[:, 0], axis=1))


def test_a_spring_swings_as_two_masses_do() -> None:
    run = pulled(3.0, length=1.6, stiffness=30.0, pushes=True)
    omega = np.sqrt(30.0 * (1.0 / MASSES[0] + 1.0 / MASSES[1]))
    expected = 1.6 + 0.4 * np.cos(omega * run.trace["time"].values)
    np.testing.assert_allclose(distance(run), expected, atol=0.01)
    assert run.values["tether_stretch_max"] == pytest.approx(0.4, abs=5e-3)
    momentum = np.einsum("tia,i->ta", run.trace["v"].values, MASSES)
    assert np.abs(momentum).max() < 1e-9


def test_a_cable_pulls_but_does_not_push() -> None:
    run = pulled(1.2, length=1.6, stiffness=30.0)
    gap, time = distance(run), run.trace["time"].values
    omega = np.sqrt(30.0 * (1.0 / MASSES[0] + 1.0 / MASSES[1]))
    slack = (gap < 1.6) & (time < time[np.argmin(gap > 0.5)])
    first = time[slack][0]
    assert first == pytest.approx(0.5 * np.pi / omega, abs=5e-3)
    closing = np.diff(gap)[slack[:-1]] / np.diff(time)[slack[:-1]]
    np.testing.assert_allclose(closing, -0.4 * omega, rtol=0.01)


def test_damping_takes_the_swing_away() -> None:
    gap = distance(pulled(3.0, length=1.6, stiffness=30.0, damping=8.0, pushes=True))
    assert abs(gap[-1] - 1.6) < 5e-3 and gap.min() > 1.55


def test_one_that_does_not_stretch_holds_its_length() -> None:
    run = pulled(2.0, apart=1.0, speed=1.0, length=1.5, stiffness=None)
    assert 1.5 < distance(run).max() < 1.52
    assert run.trace["q"].values[-1, 0, 0] > 0.3, "the first is pulled along"


def test_a_name_that_is_no_body() -> None:
    tether = {"between": [1, "taget"], "length": 1}
    robots = {"positions": [[0.0, 0.0], [2.0, 0.0]], "tethers": [tether]}
    with pytest.raises(ScenarioError, match=r"tethers\[0\].between"):
        scenario_of({"target": None, "robots": robots, "mission": {"behaviors": ["avoid_obstacles"]}})


def test_a_robot_tows_the_target() -> None:
    scenario = escort_mj.Scenario(
        duration=4,
        target={"position": [1.0, 0.0], "body": {"mass": 2.0}},
        robots={"positions": [[0.0, 0.0]], "tethers": [{"between": [1, "target"], "length": 1.2}]},
        mission={"radius": 2.0, "behaviors": ["surface"]},
    )
    assert escort_mj.run(scenario).values["tether_stretch_max"] > 0.0


def test_it_holds_a_robot_of_a_file_where_its_hull_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its base begins elsewhere."""
    monkeypatch.chdir(tmp_path)
    motors = "".join(f'<motor joint="{axis}" ctrlrange="-10 10"/>' for axis in "xy")
    Path("robot.xml").write_text(
        '<mujoco><worldbody><body name="base" pos="0 0 0.2"><joint name="x" type="slide" axis="1 0 0"/>'
        '<joint name="y" type="slide" axis="0 1 0"/><geom size="0.2" pos="0.5 0.3 0" mass="1"/></body>'
        f"</worldbody><actuator>{motors}</actuator></mujoco>"
    )
    robots = {"kind": {"kind": "mjcf", "file": "robot.xml"}, "positions": [[0.0, 0.0], [3.0, 0.0]]}
    tethers = [{"between": [1, 2], "length": 2.5, "stiffness": 1.0}]
    alone = {"target": None, "mission": {"behaviors": ["avoid_obstacles"]}}
    mission = escort_mj.start({"duration": 0.02, "robots": {**robots, "tethers": tethers}, **alone})
    data = mission.plant.data
    assert data.ten_length[0] == pytest.approx(3.0)
    sites = [data.site(f"tether_1_robot_{i}").xpos[:2] for i in (1, 2)]
    np.testing.assert_allclose(sites, [[0.0, 0.0], [3.0, 0.0]], atol=1e-12)
    mission.step(0.02)
    assert mission.run().values["tether_stretch_max"] == pytest.approx(0.5, abs=1e-3)


def test_what_a_stretched_one_gives_is_no_energy_from_nothing() -> None:
    tether = {"between": [1, 2], "length": 5, "stiffness": 40}
    robots = {"positions": [[6, 0], [-6, 0]], "tethers": [tether]}
    keys = {"duration": 3, "robots": robots, "mission": {"max_speed": 2}, "expect": [{"sanity": ["energy"]}]}
    run = escort_mj.run(keys, figures=False, video=False)
    assert run.passed and max(run.trace["speed_max"].values.max(axis=0)) > 10.0
