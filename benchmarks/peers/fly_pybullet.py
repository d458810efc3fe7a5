"""PyBullet alone: rigid balls in space, contacts on, forces from a PD law in NumPy, one Python loop.

Mode: `controlled`.
"""

from __future__ import annotations

from importlib.metadata import version

import numpy as np
import pybullet as p
import stage
from flight import Flight, serve

TIMESTEP, P, D, LIMIT = (
    1.0 / 240.0,
    30.0,
    10.0,
    20.0,
)  # its own default [s]; gains [N/m, N s/m]; force limit [N]


def fly(mode: str, n: int) -> Flight:
    """The mission of n balls of 1 kg."""
    p.connect(p.DIRECT)
    p.setTimeStep(TIMESTEP)
    places, done = stage.places(n, 3), 0
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=stage.RADIUS)
    pillar = p.createCollisionShape(p.GEOM_SPHERE, radius=stage.OBSTACLE_RADIUS)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    for center in stage.obstacles(n, 3):
        p.createMultiBody(0, pillar, basePosition=center)
    starts = places + stage.target(0.0, n, 3)[0]
    bodies = [p.createMultiBody(1.0, ball, basePosition=start) for start in starts]
    for body in bodies:  # else PyBullet puts resting bodies to sleep and forgets them
        p.changeDynamics(
            body,
            -1,
            linearDamping=0.0,
            angularDamping=0.0,
            activationState=p.ACTIVATION_STATE_DISABLE_SLEEPING,
        )
    weight = np.array([0.0, 0.0, 9.81])
    p.setGravity(*-weight)
    origin = [0.0, 0.0, 0.0]

    def position() -> np.ndarray:
        return np.array([p.getBasePositionAndOrientation(body)[0] for body in bodies])

    def control() -> None:
        velocity = np.array([p.getBaseVelocity(body)[0] for body in bodies])
        center, drift = stage.target(done * TIMESTEP, n, 3)
        force = np.clip(P * (center + places - position()) + D * (drift - velocity), -LIMIT, LIMIT) + weight
        for body, row in zip(bodies, force.tolist(), strict=True):
            p.applyExternalForce(body, -1, row, origin, p.LINK_FRAME)

    def step(count: int) -> None:
        nonlocal done
        for _ in range(count):
            control()
            p.stepSimulation()
            done += 1

    def error() -> float:
        goal = stage.target(done * TIMESTEP, n, 3)[0] + places
        return float(np.linalg.norm(position() - goal, axis=1).mean())

    return Flight(step, error, TIMESTEP, n, version("pybullet"))


if __name__ == "__main__":
    serve(fly)
