"""A scenario as a PettingZoo parallel environment: an agent for each robot."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

try:
    from gymnasium import spaces
    from pettingzoo import ParallelEnv
except ImportError as error:
    raise ImportError(f"{error}; pip install 'escort-mj[rl]' adds what is missing") from None

from escort_mj.environments.picture import SIZE, Camera, known_mode
from escort_mj.environments.seeds import Seeds
from escort_mj.environments.senses import Command, Reward, Seen
from escort_mj.environments.simulation import Simulation
from escort_mj.record.outcome import Outcome
from escort_mj.report.video.live import Picture
from escort_mj.scenario import Scenario


class EscortParallelEnv(ParallelEnv[str, Seen, NDArray[np.float32]]):
    """Agents robot_1, robot_2 ...; see `Simulation` for commands, observations and rewards.

    All agents are there until the end: the scenario's duration truncates, a mission that diverged or became
    unstable terminates.

    Attributes:
        simulation: The mission.
    """

    metadata = {"name": "escort_mj", "render_modes": ["rgb_array"]}

    def __init__(
        self,
        scenario: Scenario | str,
        command: Command = "velocity",
        reward: Reward | None = None,
        render_mode: str | None = None,
        size: tuple[int, int] = SIZE,
    ) -> None:
        """Prepare a scenario; arguments as of `EscortEnv`."""
        self.simulation = Simulation(scenario, command, reward)
        self.possible_agents = [f"robot_{i + 1}" for i in range(self.simulation.count)]
        self.agents: list[str] = []
        self.render_mode = known_mode(render_mode)
        self._camera = Camera(self.simulation, size)
        self._seeds = Seeds(self.simulation.scenario.seed)
        most, axes = self.simulation.limits, self.simulation.axes
        agents = self.possible_agents
        self.observation_spaces = {agent: spaces.Box(-most, most, dtype=np.float32) for agent in agents}
        self.action_spaces = {agent: spaces.Box(-1.0, 1.0, (axes,), np.float32) for agent in agents}

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """What an agent observes: the same object at every call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """What an agent may command: the same object at every call."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Seen], dict[str, dict[str, Any]]]:
        """Start a mission: that of a seed, or the next one of this environment's generator."""
        self.simulation.reset(self._seeds.next(seed))
        self.agents = list(self.possible_agents)
        return self._observations(), {agent: {} for agent in self.agents}

    def step(
        self, actions: dict[str, NDArray[np.float32]]
    ) -> tuple[
        dict[str, Seen],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Advance to the next sample; a robot without an action rests."""
        if not self.agents:
            return {}, {}, {}, {}, {}
        rest = np.zeros(self.simulation.axes)
        rewards = self.simulation.step(np.array([actions.get(agent, rest) for agent in self.agents]))
        outcome = self.simulation.outcome
        broken = outcome not in (Outcome.RUNNING, Outcome.COMPLETED)
        touching = self.simulation.touching
        agents = self.agents
        result = (
            self._observations(),
            {agent: float(reward) for agent, reward in zip(agents, rewards, strict=True)},
            dict.fromkeys(agents, broken),
            dict.fromkeys(agents, outcome is Outcome.COMPLETED),
            {agent: {"touching": bool(touch)} for agent, touch in zip(agents, touching, strict=True)},
        )
        if outcome is not Outcome.RUNNING:
            self.agents = []
        return result

    def state(self) -> Seen:
        """All that robots observe, one after the other, shape (n * width,)."""
        return self.simulation.observe_within().ravel()

    def render(self) -> Picture | None:
        """Return a picture of the mission as it is now, shape (height, width, 3); None without a mode."""
        return self._camera.picture() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """End what draws."""
        self._camera.close()

    def _observations(self) -> dict[str, Seen]:
        return dict(zip(self.agents, self.simulation.observe_within(), strict=True))
