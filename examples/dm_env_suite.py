"""A mission as a dm_env environment, as the suites of dm_control are: pip install dm-env."""

import dm_env
import numpy as np
from dm_env import specs

from escort_mj.environments import Simulation


class Escort(dm_env.Environment):
    """Observations and commands of all robots one below the other; the reward is the mean of theirs."""

    def __init__(self, scenario: str, command: str = "velocity") -> None:
        self.simulation = Simulation(scenario, command)
        self.seed = self.simulation.scenario.seed

    def reset(self) -> dm_env.TimeStep:
        """Start the next mission."""
        self.simulation.reset(self.seed)
        self.seed += 1
        return dm_env.restart(self.simulation.observe_within())

    def step(self, action: np.ndarray) -> dm_env.TimeStep:
        """Advance to the next sample; the first step, and the one after the last, start again."""
        if not self.simulation.under_way:
            return self.reset()
        reward = float(self.simulation.step(action).mean())
        ends = {"running": dm_env.transition, "completed": dm_env.truncation}
        end = ends.get(self.simulation.outcome.value, dm_env.termination)
        return end(reward, self.simulation.observe_within())

    def observation_spec(self) -> specs.BoundedArray:
        """Shape (n, width)."""
        most = np.tile(self.simulation.limits, (self.simulation.count, 1))
        return specs.BoundedArray(most.shape, np.float32, -most, most, "observation")

    def action_spec(self) -> specs.BoundedArray:
        """Shape (n, p), each number from -1 to 1."""
        shape = (self.simulation.count, self.simulation.axes)
        return specs.BoundedArray(shape, np.float32, -1.0, 1.0, "command")
