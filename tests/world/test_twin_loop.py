"""The native loop against the law in plain NumPy, which drives the same model from Python."""

import mujoco
import numpy as np
import pytest

from escort_mj.robots.quadrotor import Quadrotor
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World
from escort_mj.world.plant import Plant
from tests.corpus import missions
from tests.oracle.attitude import thrusts_for
from tests.oracle.reference import ReferenceController, ReferenceSignals

MISSIONS = missions(__file__)
GRAVITY = (0.0, 0.0, -9.81)


class Driver:
    """Drives a world by the NumPy law; finds robots by name, as a user would."""

    def __init__(self, world: World) -> None:
        self.model, self.axes = world.model, world.sizes["axis"]
        count = world.sizes["robot"]
        joints = [world.model.body(f"robot_{i + 1}").jntadr[0] for i in range(count)]
        self.qpos = world.model.jnt_qposadr[joints][:, None] + np.arange(self.axes)
        self.dof = world.model.jnt_dofadr[joints][:, None] + np.arange(self.axes)
        self.target, self.timestep = world.setup.target, world.setup.timestep
        self.twin = ReferenceController(world.setup, world.schedule.stride, world.schedule.extra)
        self.twin.reset(world.team.position)
        self.team = world.team
        self.avoided = np.zeros(count, dtype=bool)

    def controls(self, robot: int, data: mujoco.MjData) -> np.ndarray:
        """What the law's force means for the motors of one robot."""
        tau, kind = self.signals.tau[robot], self.team.kind[robot]
        zone = self.team.actuators[robot].dead_zone
        if not isinstance(kind, Quadrotor):
            return np.sign(tau) * np.maximum(np.abs(tau) - zone, 0.0)
        mass, radius = self.team.mass[robot], self.team.radius[robot]
        force = np.array(kind.lift(mass, GRAVITY))
        limit = self.team.force_limit[robot]
        force[: self.axes] += np.clip(tau, -limit, limit)
        (place, *_), (dof, *_) = self.qpos[robot], self.dof[robot]
        craft = kind.craft(mass, radius, GRAVITY, self.team.height)
        if self.axes == 2:
            omega, nominal = kind.height_frequency, kind.nominal_mass or mass
            lag = self.team.height - data.qpos[place + 2]
            force[2] += nominal * (omega**2 * lag - 2.0 * omega * data.qvel[dof + 2])
        orientation, rate = data.qpos[place + 3 : place + 7], data.qvel[dof + 3 : dof + 6]
        thrusts = thrusts_for(force, orientation, rate, craft)
        told = np.sign(thrusts) * np.maximum(np.abs(thrusts) - zone, 0.0)
        rotors = [self.model.actuator(f"robot_{robot + 1}_rotor_{number}") for number in (1, 2, 3, 4)]
        turning = [data.act[rotor.actadr[0]] for rotor in rotors] if rotors[0].actadr[0] >= 0 else told
        pushes = np.clip(
            [rotor.gainprm[0] * turned for rotor, turned in zip(rotors, turning, strict=True)],
            0.0,
            craft.rotor_limit,
        )
        matrix = np.empty(9)
        mujoco.mju_quat2Mat(matrix, orientation)
        return np.concatenate([told, pushes.sum() * matrix.reshape(3, 3)[:, 2]])

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> ReferenceSignals:
        self.signals = self.twin.evaluate(data.time, data.qpos[self.qpos], data.qvel[self.dof])
        self.avoided |= self.signals.avoidance_active
        data.ctrl[:] = np.concatenate([self.controls(i, data) for i in range(len(self.qpos))])
        data.qfrc_applied[self.dof] = self.signals.disturbance
        ahead = self.target.position(data.time + self.timestep)[:3]
        data.mocap_pos[0, : len(ahead)] = ahead
        return self.signals


def by_halves(world: World, data: mujoco.MjData, driver: Driver, steps: int) -> None:
    for _ in range(steps):
        mujoco.mj_step1(world.model, data)
        driver(world.model, data)
        mujoco.mj_step2(world.model, data)


def by_callback(world: World, data: mujoco.MjData, driver: Driver, steps: int) -> None:
    mujoco.set_mjcb_control(driver)
    try:
        mujoco.mj_step(world.model, data, nstep=steps)
    finally:
        mujoco.set_mjcb_control(None)


@pytest.mark.parametrize("steps", [60, pytest.param(5000, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("keys", "drive"),
    [
        pytest.param(MISSIONS["planar"], by_halves, id="planar_halves"),
        pytest.param(MISSIONS["planar"], by_callback, id="planar_callback", marks=pytest.mark.slow),
        pytest.param(MISSIONS["spatial"], by_callback, id="spatial_callback"),
        pytest.param(MISSIONS["rolling"], by_halves, id="rolling_halves"),
        pytest.param(MISSIONS["four"], by_halves, id="four_halves"),
        pytest.param(MISSIONS["mixed"], by_halves, id="mixed_halves"),
        pytest.param(MISSIONS["flying"], by_halves, id="flying_halves"),
        pytest.param(MISSIONS["seeing"], by_halves, id="sensors_halves"),
    ],
)
def test_many_steps_agree(keys: dict, drive, steps: int, make_world) -> None:
    world = make_world(**keys)
    with native_loop(world):
        plant = Plant(world)
        plant.step(steps)
    data, driver = mujoco.MjData(world.model), Driver(world)
    if world.model.nkey:
        mujoco.mj_resetDataKeyframe(world.model, data, 0)
    drive(world, data, driver, steps)
    assert data.time == plant.data.time == pytest.approx(0.002 * steps)
    assert driver.avoided.any() and not driver.avoided.all()
    difference = {
        "qpos": np.abs(data.qpos - plant.data.qpos).max(),
        "qvel": np.abs(data.qvel - plant.data.qvel).max(),
        **{
            name: np.abs(getattr(plant.state, name) - getattr(driver.signals, name)).max()
            for name in ("q_measured", "q_d", "v_d", "e", "s", "rho_hat", "disturbance", "target_position")
        },
    }
    print({name: f"{value:.1e}" for name, value in difference.items()})
    assert max(difference.values()) < 1e-6, difference
