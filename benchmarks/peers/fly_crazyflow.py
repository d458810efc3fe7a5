"""crazyflow: quadrotors in JAX, single precision, its Mellinger controller; drones pass through each other.

Modes: `compiled`, the places of the robots computed in JAX inside its compiled loop; `stepped`, told from
Python before every step; `worlds`, as `compiled` in as many worlds at once as `WORLDS` says.
"""

from __future__ import annotations

from importlib.metadata import version

import jax
import jax.numpy as jnp
import numpy as np
import stage
from crazyflow import Sim
from crazyflow.control import Control
from crazyflow.sim.pipeline import prepend_fn
from flight import Flight, serve

RATE, WORLDS = 500, 1024  # its own default [Hz]
CHUNK = 50  # steps in a compiled call


def fly(mode: str, n: int) -> Flight:
    """The mission of n drones."""
    worlds = WORLDS if mode == "worlds" else 1
    chunk = 1 if mode == "stepped" else CHUNK
    sim = Sim(n_worlds=worlds, n_drones=n, control=Control.state, freq=RATE)
    places = jnp.asarray(stage.places(n, 3), dtype=jnp.float32)
    start = np.broadcast_to(stage.places(n, 3) + stage.target(0.0, n, 3)[0], (worlds, n, 3))
    sim.data = sim.data.replace(states=sim.data.states.replace(pos=jnp.asarray(start, dtype=jnp.float32)))
    upright = jnp.zeros((worlds, n, 16)).at[..., 12].set(1.0)
    pace, center = stage.SPEED / stage.SWEEP, jnp.array([0.0, 0.0, stage.height(n, 3)])

    def setpoints(time: jax.Array) -> jax.Array:
        across = jnp.concatenate([jnp.cos(pace * time), jnp.sin(pace * time), 0.0 * time], axis=-1)[:, None]
        drift = stage.SPEED * jnp.stack([-across[..., 1], across[..., 0], across[..., 2]], axis=-1)
        return upright.at[..., :3].set(center + stage.SWEEP * across + places).at[..., 3:6].set(drift)

    def tell(data):  # noqa: ANN001, ANN202
        command = setpoints(data.core.steps / data.core.freq)
        state = data.controls.state.replace(staged_cmd=command)
        return data.replace(controls=data.controls.replace(state=state))

    if mode != "stepped":
        prepend_fn(sim.step_pipeline, tell, name="places")
        sim.build_step_fn()
    compiled = jax.jit(setpoints)

    def step(count: int) -> None:
        for _ in range(count // chunk):
            if mode == "stepped":
                sim.state_control(compiled(sim.data.core.steps / RATE))
            sim.step(chunk)
        jax.block_until_ready(sim.data.states.pos)

    def error() -> float:
        goal = setpoints(sim.data.core.steps / RATE)[..., :3]
        return float(jnp.linalg.norm(sim.data.states.pos - goal, axis=-1).mean())

    return Flight(step, error, 1.0 / RATE, n * worlds, version("crazyflow"), chunk)


if __name__ == "__main__":
    serve(fly)
