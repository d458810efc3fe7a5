"""A scenario as a Gymnasium environment: one policy for all robots, or for all opponents."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

try:
    import gymnasium
    from gymnasium import spaces
    from gymnasium.utils import EzPickle
except ImportError as error:
    raise ImportError(f"{error}; pip install 'escort-mj[rl]' adds what is missing") from None

from escort_mj.environments.draws import told, values_in
from escort_mj.environments.fleet import OneSide
from escort_mj.environments.own import Parts
from escort_mj.environments.picture import SIZE, Camera, RenderMode, Size
from escort_mj.environments.rivals import RivalReward
from escort_mj.environments.seeds import Seeds
from escort_mj.environments.senses import Command, Reward, Seen
from escort_mj.environments.simulation import Simulation
from escort_mj.record.outcome import Outcome
from escort_mj.report.video.live import Picture
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import Source, checked


class EscortEnv(gymnasium.Env[Seen, NDArray[np.float32]], EzPickle):
    """Observations and commands of all robots one below the other; the reward is the mean of theirs.

    With `side="opponents"`, the same of the opponents; their mission also terminates when none is left.

    Attributes:
        simulation: The mission.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}

    @checked
    def __init__(
        self,
        scenario: Scenario | Source = "main",
        command: Command = "velocity",
        reward: Reward | None = None,
        render_mode: RenderMode | None = None,
        size: Size = SIZE,
        side: OneSide = "robots",
        rival_reward: RivalReward | None = None,
        sample: Mapping[str, Any] | None = None,
        own: Parts = (),
    ) -> None:
        """Prepare a scenario.

        Args:
            scenario: As of `Simulation`.
            command: As of `Simulation`.
            reward: As of `Simulation`.
            render_mode: `rgb_array` for pictures; None for none.
            size: Width and height of pictures [pixel].
            side: Who is commanded; the others do as the scenario says.
            rival_reward: As of `Simulation`.
            sample: As of `Simulation`.
            own: As of `Simulation`.

        Raises:
            UsageError: If an argument is not of its kind, or forces are to be commanded without a limit, or
                opponents and there are none, or both sides, or the mode of rendering is not known.
            ScenarioError: If what `sample` has is impossible.
        """
        EzPickle.__init__(self, scenario, command, reward, render_mode, size, side, rival_reward, sample, own)
        self.simulation = Simulation(scenario, command, reward, side, rival_reward, sample, own)
        self.render_mode = render_mode
        self.metadata = self.metadata | {"render_fps": round(self.simulation.scenario.recording.rate)}
        self._camera = Camera(self.simulation, size)
        self._seeds = Seeds(self.simulation.scenario.seed)
        side_of = self.simulation.rivals or self.simulation
        self.observation_space, self.action_space = spaces_of(
            side_of.limits, side_of.count, self.simulation.axes
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Seen, dict[str, Any]]:
        """Start a mission: that of a seed, or the next one of this environment's generator.

        Args:
            seed: The mission is then that of `escort-mj run` with this seed. Without one, the first mission
                has the scenario's seed, and each later one a seed drawn after the last seed asked for.
            options: `set`, a table of scenario keys and their values in this mission, also in place of what
                is drawn.

        Returns:
            What is observed, and infos: `set`, what is drawn and set in this mission, if anything is.

        Raises:
            UsageError: If the seed is no whole number of at least 0, or there are other options, or values
                make a mission of another shape.
            ScenarioError: If values are impossible.
        """
        values = values_in(options)
        mission = self._seeds.next(seed)
        super().reset(seed=None if seed is None else mission)
        self.simulation.reset(mission, values=values)
        return self._observed(), told(self.simulation.values)

    def step(self, action: NDArray[np.float32]) -> tuple[Seen, float, bool, bool, dict[str, Any]]:
        """Advance to the next sample.

        Raises:
            UsageError: As of `Simulation.step`.
        """
        simulation, rivals = self.simulation, self.simulation.rivals
        rewards = simulation.step(None, action) if rivals else simulation.step(action)
        broken = simulation.outcome not in (Outcome.RUNNING, Outcome.COMPLETED)
        info: dict[str, Any] = {"touching": simulation.touching, "reward_terms": simulation.reward_terms}
        if rivals:
            rewards, info = rivals.rewards, {"comes": rivals.comes}
        return (
            self._observed(),
            float(rewards.mean()),
            broken or bool(rivals and rivals.over.all()),
            simulation.outcome is Outcome.COMPLETED,
            info | {"rewards": rewards, "outcome": simulation.outcome.value},
        )

    def render(self) -> Picture | None:
        """Return a picture of the mission as it is now, shape (height, width, 3); None without a mode.

        Raises:
            UsageError: If the mission was not started.
            RenderError: If nothing can be drawn on this machine.
        """
        return self._camera.picture() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """End what draws."""
        self._camera.close()

    def _observed(self) -> Seen:
        """What the side that is commanded observes."""
        rivals = self.simulation.rivals
        return rivals.observed if rivals else self.simulation.observe_within()


def spaces_of(limits: Seen, robots: int, axes: int) -> tuple[spaces.Space[Any], spaces.Space[Any]]:
    """Return what a side observes, and what it may command: shapes (n, width) and (n, p).

    Args:
        limits: Largest size of each number that a robot or opponent observes, shape (width,).
        robots: n, or how many opponents there are.
        axes: p.
    """
    most = np.tile(limits, (robots, 1))
    observed = spaces.Box(-most, most, dtype=np.float32)
    return observed, spaces.Box(-1.0, 1.0, (robots, axes), np.float32)
