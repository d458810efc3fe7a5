"""A scenario as a dm_env environment, as dm_control's own suites are."""

from __future__ import annotations

import dm_env
import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from escort_mj.environments.seeds import Seeds
from escort_mj.environments.senses import Command, Reward
from escort_mj.environments.simulation import Simulation
from escort_mj.record.outcome import Outcome
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import Source, checked

Array = NDArray[np.float64]


class EscortEnvironment(dm_env.Environment):
    """Observations and commands of all robots one below the other; the reward is the mean of theirs.

    A mission that completes ends with discount 1, one that breaks with discount 0.

    Attributes:
        simulation: The mission.
    """

    @checked
    def __init__(
        self, scenario: Scenario | Source, command: Command = "velocity", reward: Reward | None = None
    ) -> None:
        """Prepare a scenario; arguments as of `Simulation`."""
        self.simulation = Simulation(scenario, command, reward)
        self._seeds = Seeds(self.simulation.scenario.seed)

    def reset(self) -> dm_env.TimeStep:
        """Start the next mission: the scenario's own at first, then each with a seed drawn after that one."""
        self.simulation.reset(self._seeds.next())
        return dm_env.restart(self.simulation.observe_within())

    def step(self, action: Array) -> dm_env.TimeStep:
        """Advance to the next sample; the first step, and the one after the last, start again."""
        if not self.simulation.under_way:
            return self.reset()
        reward = float(self.simulation.step(action).mean())
        observation, outcome = self.simulation.observe_within(), self.simulation.outcome
        if outcome is Outcome.RUNNING:
            return dm_env.transition(reward, observation)
        if outcome is Outcome.COMPLETED:
            return dm_env.truncation(reward, observation)
        return dm_env.termination(reward, observation)

    def observation_spec(self) -> specs.BoundedArray:
        """Shape (n, width)."""
        most = np.tile(self.simulation.limits, (self.simulation.count, 1))
        return specs.BoundedArray(most.shape, np.float32, -most, most, "observation")

    def action_spec(self) -> specs.BoundedArray:
        """Shape (n, p), each number from -1 to 1."""
        shape = (self.simulation.count, self.simulation.axes)
        return specs.BoundedArray(shape, np.float32, -1.0, 1.0, "command")
