"""A scenario as a Gymnasium environment: one policy for the whole team."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

try:
    import gymnasium
    from gymnasium import spaces
except ImportError as error:
    raise ImportError(f"{error}; pip install 'escort-mj[rl]' adds what is missing") from None

from escort_mj.environments.simulation import Command, Reward, Simulation
from escort_mj.record.outcome import Outcome
from escort_mj.scenario import Scenario

Array = NDArray[np.float64]


class EscortEnv(gymnasium.Env[Array, NDArray[np.float32]]):
    """Observations and commands of all robots one below the other; the reward is the mean of theirs.

    Attributes:
        simulation: The mission.
    """

    metadata = {"render_modes": []}

    def __init__(
        self, scenario: Scenario | str = "main", command: Command = "velocity", reward: Reward | None = None
    ) -> None:
        """Prepare a scenario; arguments as of `Simulation`."""
        self.simulation = Simulation(scenario, command, reward)
        count, axes = self.simulation.count, self.simulation.axes
        self.observation_space = spaces.Box(-np.inf, np.inf, (count, self.simulation.width), np.float64)
        self.action_space = spaces.Box(-1.0, 1.0, (count, axes), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start a mission; without a seed the scenario's own, or the one before."""
        super().reset(seed=seed)
        self.simulation.reset(seed)
        return self.simulation.observe(), {}

    def step(self, action: NDArray[np.float32]) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Advances to the next sample."""
        rewards = self.simulation.step(np.asarray(action, dtype=float))
        outcome = self.simulation.outcome
        return (
            self.simulation.observe(),
            float(rewards.mean()),
            outcome not in (Outcome.RUNNING, Outcome.COMPLETED),
            outcome is Outcome.COMPLETED,
            {"touching": self.simulation.touching, "outcome": outcome.value},
        )
