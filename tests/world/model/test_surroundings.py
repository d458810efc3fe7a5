"""Floor, slope and medium against analysis; bodies that move by themselves, and what they push."""

import math

import mujoco
import numpy as np
import pytest

from escort_mj.scenario import parse_scenario
from escort_mj.scenario.reader.dump import flow
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World, build
from escort_mj.world.plant import Plant

G = 9.81
BALL = {
    "robots": {"kind": "rolling_sphere", "positions": [[0, 0]], "radius": 0.3},
    "target": {"position": [9, 9]},
}


def made(**keys) -> World:
    return build(parse_scenario(flow(keys)))


def free_fall(world: World, seconds: float) -> mujoco.MjData:
    """The world left to itself: no callbacks, no motors."""
    data = mujoco.MjData(world.model)
    mujoco.mj_step(world.model, data, nstep=round(seconds / world.model.opt.timestep))
    return data


def velocity(world: World, data: mujoco.MjData) -> np.ndarray:
    dof = world.model.jnt_dofadr[world.model.body("robot_1").jntadr[0]]
    return data.qvel[dof : dof + world.sizes["axis"]].copy()


@pytest.mark.parametrize("direction", [0.0, 2.1])
def test_a_ball_rolls_down_a_slope(direction: float):
    angle = math.radians(10.0)
    world = made(**BALL, environment={"slope": {"angle": angle, "direction": direction}})
    v = velocity(world, free_fall(world, 1.0))
    wanted = 5.0 / 7.0 * G * math.sin(angle) * np.array([math.cos(direction), math.sin(direction)])
    np.testing.assert_allclose(v, wanted, atol=0.01 * np.linalg.norm(wanted))


def test_a_ball_on_ice_slides_down_and_a_point_mass_feels_the_slope():
    angle = math.radians(10.0)
    slope = {"slope": {"angle": angle}}
    ice = made(**BALL, environment=slope | {"floor": {"friction": 0.0}})
    sliding = made(robots={"positions": [[0, 0]]}, target={"position": [9, 9]}, environment=slope)
    for world in (ice, sliding):
        v = velocity(world, free_fall(world, 1.0))
        np.testing.assert_allclose(v, [G * math.sin(angle), 0.0], atol=0.02)


def test_rolling_friction_stops_a_ball():
    """A ball that rolls is slowed by mu_r N / R at its rim: 5/7 of that over m."""
    arm = 0.01
    world = made(**BALL, environment={"floor": {"rolling_friction": arm}})
    data = mujoco.MjData(world.model)
    mujoco.mj_step(world.model, data, nstep=200)  # it settles on the floor
    data.qvel[0], data.qvel[4] = 1.5, 1.5 / 0.3
    mujoco.mj_step(world.model, data, nstep=500)
    assert data.qvel[0] == pytest.approx(1.5 - 5.0 / 7.0 * arm * G / 0.3 * 1.0, abs=0.02)


AIR = {
    "robots": {"positions": [[0, 0, 0]], "radius": 0.2, "mass": 2.0},
    "axes": 3,
    "target": {"position": [50, 0, 0]},
}


def test_terminal_velocity_in_a_dense_medium():
    """Drag of MuJoCo's ellipsoid model on a ball: C rho A v^2 with C = 0.5; no buoyancy."""
    density = 20.0
    world = made(**AIR, physics={"gravity": [0, 0, -G]}, environment={"medium": {"density": density}})
    v = velocity(world, free_fall(world, 20.0))
    wanted = math.sqrt(2.0 * G / (0.5 * density * math.pi * 0.2**2))
    np.testing.assert_allclose(v, [0.0, 0.0, -wanted], atol=1e-3 * wanted)


def test_terminal_velocity_in_a_viscous_medium():
    """Stokes' law: 6 pi mu r v."""
    viscosity = 10.0
    world = made(**AIR, physics={"gravity": [0, 0, -1]}, environment={"medium": {"viscosity": viscosity}})
    v = velocity(world, free_fall(world, 5.0))
    np.testing.assert_allclose(v, [0.0, 0.0, -2.0 / (6.0 * math.pi * viscosity * 0.2)], rtol=1e-3, atol=1e-9)


def test_wind_carries_away():
    medium = {"density": 50.0, "viscosity": 10.0, "wind": [3.0, -1.0, 0.5]}
    world = made(**AIR, environment={"medium": medium})
    np.testing.assert_allclose(velocity(world, free_fall(world, 20.0)), medium["wind"], rtol=1e-3)


FAR = {
    "robots": {"positions": [[40, 0], [0, 40]]},
    "mission": {"radius": 30.0},
    "target": {"position": [0, 0]},
}


@pytest.mark.parametrize("motion", [["2*sin(t)", "0.5*t"], None])
def test_moving_obstacles_keep_to_their_trajectories(motion):
    said = (
        {"position": motion}
        if motion
        else {
            "waypoints": [{"time": 0, "position": [0, 5]}, {"time": 3, "position": [6, 5]}],
            "interpolation": "smooth",
        }
    )
    world = made(
        **(FAR | {"target": {"position": [20, 20]}}),
        obstacles=[{"shape": "box", "size": [1, 0.5], "motion": said}],
    )
    plant, (mover,) = Plant(world), world.setup.movers
    with native_loop(world):
        for _ in range(50):
            plant.step(50)
            t = plant.data.time - 0.002  # the evaluation of the last step
            np.testing.assert_allclose(plant.state.obstacle_position[0], mover.path.position(t), atol=0.02)
            np.testing.assert_allclose(plant.state.mover_velocity[0], mover.path.velocity(t), atol=0.03)


def test_a_pusher_pushes_and_a_weak_one_is_stopped():
    """A driven ball against a robot whose motors are dead moves it; one of a weak drive is stopped."""
    moved = []
    for mass, body in ((1.0, {}), (1e6, {"mass": 5.0, "force_limit": 1.0})):
        world = made(
            robots={"positions": [[3, 0], [-9, 9]], "mass": mass, "failures": [{"robot": 1, "at": 0.0}]},
            target={"position": [0, 9]},
            obstacles=[{"motion": {"position": ["t", 0]}, "body": body}],
        )
        plant = Plant(world)
        with native_loop(world):
            plant.step(2500)
        moved.append((plant.state.q[0, 0], plant.state.obstacle_position[0, 0]))
    (pushed, pusher), (heavy, stopped) = moved
    assert pushed > 5.0 and pusher == pytest.approx(5.0, abs=0.05)
    assert heavy == pytest.approx(3.0, abs=0.01) and stopped < 2.4


def test_a_target_that_is_bumped_leaves_its_trajectory_and_comes_back():
    world = made(
        **(FAR | {"target": {"position": [0, 0], "body": {"mass": 2.0, "force_limit": 20.0}}}),
        obstacles=[
            {
                "motion": {
                    "waypoints": [
                        {"time": 0, "position": [-4, 0]},
                        {"time": 3, "position": [-0.4, 0]},
                        {"time": 4, "position": [-4, 0]},
                    ]
                }
            }
        ],
    )
    plant, farthest = Plant(world), 0.0
    with native_loop(world):
        for _ in range(400):
            plant.step(10)
            farthest = max(farthest, float(plant.state.target_position[0]))
            assert plant.state.target_position == pytest.approx(plant.state.mover_position[1])
    assert farthest > 0.3
    assert plant.state.target_position == pytest.approx([0.0, 0.0], abs=0.01)
