"""VMAS: discs in the plane, its own vectorized engine with penalty contacts, forces from a PD law in PyTorch.

Modes: `one`, a single world; `worlds`, as many at once as `WORLDS` says.
"""

from __future__ import annotations

from importlib.metadata import version

import stage
import torch
from flight import Flight, serve
from vmas import make_env
from vmas.simulator.core import Agent, Landmark, Sphere, World
from vmas.simulator.scenario import BaseScenario

WORLDS = 1024
P, D, LIMIT = 4.0, 3.0, 10.0  # gains [N/m, N s/m] and largest force [N]


class Escort(BaseScenario):
    """The mission with as little around it as VMAS allows: no reward, and a robot observes its place."""

    def make_world(self, batch_dim: int, device: torch.device, **kwargs: int) -> World:
        """Robots and obstacles that collide."""
        self.n = kwargs["n"]
        world = World(batch_dim, device)
        for i in range(self.n):
            body = Sphere(radius=stage.RADIUS)
            world.add_agent(
                Agent(name=f"robot_{i}", shape=body, collide=True, u_range=LIMIT, render_action=False)
            )
        for j in range(4):
            world.add_landmark(Landmark(f"obstacle_{j}", Sphere(radius=stage.OBSTACLE_RADIUS), collide=True))
        return world

    def reset_world_at(self, env_index: int | None = None) -> None:
        """Everyone at its place."""
        starts = stage.places(self.n, 2) + stage.target(0.0, self.n, 2)[0]
        bodies = [*self.world.agents, *self.world.landmarks]
        for body, center in zip(bodies, [*starts, *stage.obstacles(self.n, 2)], strict=True):
            body.set_pos(torch.tensor(center, dtype=torch.float32), batch_index=env_index)

    def reward(self, agent: Agent) -> torch.Tensor:
        """None."""
        return torch.zeros(self.world.batch_dim)

    def observation(self, agent: Agent) -> torch.Tensor:
        """Its position."""
        return agent.state.pos


def fly(mode: str, n: int) -> Flight:
    """The mission of n robots, in one or in many worlds."""
    worlds = WORLDS if mode == "worlds" else 1
    env = make_env(Escort(), num_envs=worlds, n=n)
    agents, timestep, done = env.agents, env.world.dt, 0
    places = torch.tensor(stage.places(n, 2), dtype=torch.float32)

    def goal() -> tuple[torch.Tensor, torch.Tensor]:
        center, drift = stage.target(done * timestep, n, 2)
        return torch.tensor(center, dtype=torch.float32) + places, torch.tensor(drift, dtype=torch.float32)

    def position() -> torch.Tensor:
        return torch.stack([agent.state.pos for agent in agents], dim=1)

    def step(count: int) -> None:
        nonlocal done
        for _ in range(count):
            place, drift = goal()
            velocity = torch.stack([agent.state.vel for agent in agents], dim=1)
            force = (P * (place - position()) + D * (drift - velocity)).clamp(-LIMIT, LIMIT)
            env.step(list(force.unbind(1)))
            done += 1

    def error() -> float:
        return float((position() - goal()[0]).norm(dim=-1).mean())

    return Flight(step, error, timestep, n * worlds, version("vmas"))


if __name__ == "__main__":
    with torch.no_grad():
        serve(fly)
