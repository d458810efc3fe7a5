"""A scenario as a PettingZoo parallel environment: an agent for each robot, each opponent, or both."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import numpy as np
from numpy.typing import NDArray

try:
    from gymnasium import spaces
    from gymnasium.utils import EzPickle
    from pettingzoo import ParallelEnv
except ImportError as error:
    raise ImportError(f"{error}; pip install 'escort-mj[rl]' adds what is missing") from None

from escort_mj.environments.draws import told, values_in
from escort_mj.environments.fleet import Side
from escort_mj.environments.own import Parts
from escort_mj.environments.picture import SIZE, Camera, RenderMode, Size
from escort_mj.environments.rivals import RivalReward
from escort_mj.environments.seeds import Seeds
from escort_mj.environments.senses import Command, Reward, Seen
from escort_mj.environments.simulation import Simulation
from escort_mj.record.outcome import Outcome
from escort_mj.report.video.live import Picture
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import Source, argument_error, checked, numbers


class EscortParallelEnv(ParallelEnv[str, Seen, NDArray[np.float32]], EzPickle):
    """Agents robot_1, robot_2 ..., opponent_1 ...; `Simulation` and `Rivals` say what they command and see.

    All robots are there until the end: the scenario's duration truncates, a mission that diverged or became
    unstable terminates. An opponent terminates when it is intercepted or has reached the target; until it
    comes, its commands have no effect.

    Attributes:
        simulation: The mission.
    """

    metadata = {"name": "escort_mj", "render_modes": ["rgb_array"]}

    @checked
    def __init__(
        self,
        scenario: Scenario | Source,
        command: Command = "velocity",
        reward: Reward | None = None,
        render_mode: RenderMode | None = None,
        size: Size = SIZE,
        side: Side = "robots",
        rival_reward: RivalReward | None = None,
        sample: Mapping[str, Any] | None = None,
        own: Parts = (),
    ) -> None:
        """Prepare a scenario; arguments as of `EscortEnv` and `Simulation`."""
        EzPickle.__init__(self, scenario, command, reward, render_mode, size, side, rival_reward, sample, own)
        self.simulation = simulation = Simulation(scenario, command, reward, side, rival_reward, sample, own)
        robots = [f"robot_{i + 1}" for i in range(simulation.count if side != "opponents" else 0)]
        rivals = simulation.rivals
        self._opponents = [f"opponent_{o + 1}" for o in range(rivals.count if rivals else 0)]
        self.possible_agents = [*robots, *self._opponents]
        self.render_mode = render_mode
        self._camera = Camera(simulation, size)
        self._seeds = Seeds(simulation.scenario.seed)
        most = simulation.limits
        self.observation_spaces = {agent: spaces.Box(-most, most, dtype=np.float32) for agent in robots}
        if rivals:
            seen = spaces.Box(-rivals.limits, rivals.limits, dtype=np.float32)
            self.observation_spaces |= {agent: deepcopy(seen) for agent in self._opponents}
        act = spaces.Box(-1.0, 1.0, (simulation.axes,), np.float32)
        self.action_spaces = {agent: deepcopy(act) for agent in self.possible_agents}
        limits = np.concatenate([self.observation_spaces[agent].high for agent in self.possible_agents])
        self.state_space = spaces.Box(-limits, limits, dtype=np.float32)

    @property
    def agents(self) -> list[str]:
        """Who goes on: nobody before the start and after the end, no opponent whose way has ended."""
        simulation, rivals = self.simulation, self.simulation.rivals
        if not simulation.under_way:
            return []
        over = rivals.over if rivals else ()
        gone = {name for name, ended in zip(self._opponents, over, strict=True) if ended}
        return [agent for agent in self.possible_agents if agent not in gone]

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """What an agent observes: the same object at every call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """What an agent may command: the same object at every call."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Seen], dict[str, dict[str, Any]]]:
        """Start a mission: that of a seed, or the next one of this environment's generator.

        Options are those of `EscortEnv`. Infos have the keys of those of `step`, and `set` as those of
        `EscortEnv`. An option `options`, which the tests of PettingZoo give, is not used.

        Raises:
            UsageError: As of `EscortEnv.reset`.
            ScenarioError: If values are impossible.
        """
        values = values_in(options, ("options",))
        self.simulation.reset(self._seeds.next(seed), values=values)
        seen = dict(zip(self.possible_agents, self._seen(), strict=True))
        begun = told(self.simulation.values)
        return seen, {
            agent: info | begun
            for agent, info in zip(self.possible_agents, self._infos(earned=False), strict=True)
        }

    def step(
        self, actions: dict[str, NDArray[np.float32]]
    ) -> tuple[
        dict[str, Seen],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Advance to the next sample; who is without an action rests.

        Raises:
            UsageError: If there is an action of nobody, or one of another shape or with a number that is not
                finite.
        """
        if not isinstance(actions, Mapping):
            raise argument_error("actions", actions, "actions by the names of agents")
        if not self.agents:
            return {}, {}, {}, {}, {}
        if unknown := [agent for agent in actions if agent not in self.possible_agents]:
            raise argument_error("actions", unknown[0], f"names of agents: {', '.join(self.possible_agents)}")
        simulation, shape = self.simulation, (self.simulation.axes,)
        given = np.zeros((len(self.possible_agents), *shape))
        for row, agent in enumerate(self.possible_agents):
            if agent in actions:
                given[row] = numbers(actions[agent], f"action of {agent}", shape, "shares from -1 to 1")
        robots, agents = len(given) - len(self._opponents), self.agents
        earned = simulation.step(
            given[:robots] if robots else None, given[robots:] if self._opponents else None
        )
        outcome = simulation.outcome
        broken = outcome not in (Outcome.RUNNING, Outcome.COMPLETED)
        rewards, over = earned[:robots], np.full(robots, broken)
        if rivals := simulation.rivals:
            rewards, over = np.append(rewards, rivals.rewards), np.append(over, rivals.over | broken)
        each = dict(
            zip(self.possible_agents, zip(rewards, over, self._infos(earned=True), strict=True), strict=True)
        )
        seen = dict(zip(self.possible_agents, self._seen(), strict=True))
        return (
            {agent: seen[agent] for agent in agents},
            {agent: float(each[agent][0]) for agent in agents},
            {agent: bool(each[agent][1]) for agent in agents},
            dict.fromkeys(agents, outcome is Outcome.COMPLETED),
            {agent: each[agent][2] for agent in agents},
        )

    def _infos(self, earned: bool) -> list[dict[str, Any]]:
        """What is told of each agent; where no reward was earned, its terms are 0."""
        simulation, rivals = self.simulation, self.simulation.rivals
        count, terms = len(self.possible_agents) - len(self._opponents), simulation.reward_terms
        robots: list[dict[str, Any]] = [
            {
                "touching": bool(simulation.touching[robot]),
                "reward_terms": {name: float(term[robot]) if earned else 0.0 for name, term in terms.items()},
            }
            for robot in range(count)
        ]
        return robots + [{"comes": bool(comes)} for comes in (rivals.comes if rivals else ())]

    def state(self) -> Seen:
        """All that all agents observe, one after the other, shape (sum of widths,)."""
        return np.concatenate([seen.ravel() for seen in self._seen()])

    def render(self) -> Picture | None:
        """Return a picture of the mission as it is now, shape (height, width, 3); None without a mode."""
        return self._camera.picture() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """End what draws."""
        self._camera.close()

    def _seen(self) -> list[Seen]:
        """What each of all possible agents observes."""
        rivals = self.simulation.rivals
        robots = self.simulation.observe_within() if len(self._opponents) < len(self.possible_agents) else ()
        return [*robots, *(rivals.observed if rivals else ())]
