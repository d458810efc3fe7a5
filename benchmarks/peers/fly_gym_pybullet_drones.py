"""gym-pybullet-drones: quadrotors as rigid bodies in PyBullet, contacts on.

Modes: `pid`, its own PID for each drone at 48 Hz as in its example; `constant`, rotors at hover speed.
"""

from __future__ import annotations

from importlib.metadata import version

import numpy as np
import pybullet as p
import stage
from flight import Flight, serve
from gym_pybullet_drones.control.DSLPIDControl import DSLPIDControl
from gym_pybullet_drones.envs.CtrlAviary import CtrlAviary
from gym_pybullet_drones.utils.enums import DroneModel, Physics

PHYSICS_RATE, CONTROL_RATE = 240, 48  # of its example [Hz]


def fly(mode: str, n: int) -> Flight:
    """The mission of n drones."""
    places, done = stage.places(n, 3), 0
    env = CtrlAviary(
        drone_model=DroneModel.CF2X,
        num_drones=n,
        initial_xyzs=places + stage.target(0.0, n, 3)[0],
        physics=Physics.PYB,
        pyb_freq=PHYSICS_RATE,
        ctrl_freq=CONTROL_RATE,
        gui=False,
        user_debug_gui=False,
    )
    pillar = p.createCollisionShape(p.GEOM_SPHERE, radius=stage.OBSTACLE_RADIUS, physicsClientId=env.CLIENT)
    for center in stage.obstacles(n, 3):
        p.createMultiBody(0, pillar, basePosition=center, physicsClientId=env.CLIENT)
    controllers = [DSLPIDControl(drone_model=DroneModel.CF2X) for _ in range(n)]
    action = np.full((n, 4), env.HOVER_RPM)

    def step(count: int) -> None:
        nonlocal done
        for _ in range(count // env.PYB_STEPS_PER_CTRL):
            observed = env.step(action)[0]
            done += 1
            if mode == "constant":
                continue
            center, drift = stage.target(done / CONTROL_RATE, n, 3)
            for i, controller in enumerate(controllers):
                action[i] = controller.computeControlFromState(
                    control_timestep=env.CTRL_TIMESTEP,
                    state=observed[i],
                    target_pos=center + places[i],
                    target_vel=drift,
                )[0]

    def error() -> float:
        goal = stage.target(done / CONTROL_RATE, n, 3)[0] + places
        return float(np.linalg.norm(env.pos - goal, axis=1).mean())

    # What counts as a step is one of physics; a call of its environment makes several.
    return Flight(step, error, 1.0 / PHYSICS_RATE, n, version("gym-pybullet-drones"), env.PYB_STEPS_PER_CTRL)


if __name__ == "__main__":
    serve(fly)
