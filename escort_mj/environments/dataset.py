"""Missions flown by a scenario's own law as a Minari data set, for imitation and offline learning."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.api import load_scenario
from escort_mj.environments.fleet import due
from escort_mj.environments.registration import ENVIRONMENT
from escort_mj.environments.senses import Command, Reward, Seen, Senses
from escort_mj.mission import bound_of, examine
from escort_mj.record.outcome import Outcome
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import Source, checked
from escort_mj.signals import columns
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

if TYPE_CHECKING:
    from minari import MinariDataset

Array = NDArray[np.float64]
SIGNALS = {"velocity": "v_d", "force": "tau"}  # what the law gives where a policy gives commands


class LawEpisode(NamedTuple):
    """A mission of T commands to n robots.

    Attributes:
        observations: Before each command and after the last, shape (T + 1, n, width).
        actions: What the law gave when each was due, cut off at the largest command, shape (T, n, p).
        rewards: Mean over robots, shape (T,).
        outcome: How it ended.
    """

    observations: Seen
    actions: Seen
    rewards: Array
    outcome: Outcome


@checked
def law_episode(
    scenario: Scenario, command: Command = "velocity", reward: Reward | None = None
) -> LawEpisode:
    """Fly a scenario by its own law, and say what a policy would have observed and commanded.

    The law goes on between samples: only where `recording.rate` is that of the physics would the same actions
    lead an environment along the same way, to the precision of float32.

    Args:
        scenario: What to fly.
        command: What a policy would command.
        reward: Weights of what is asked; None for those of `Reward`.

    Raises:
        UsageError: If commands are forces and there is no limit to scale them by, or `command` or `reward` is
            not of its kind.
    """
    world = build(scenario)
    plant, bound = Plant(world), bound_of(scenario, world)
    senses = Senses(plant, 1, command, reward or Reward())
    senses.enter(0, plant, bound)
    limits, given = senses.limits(bound), columns(SIGNALS[command], world.sizes)
    observed: list[Seen] = []
    actions: list[Array] = []
    rewards: list[float] = []
    taken, outcome = 0, Outcome.RUNNING
    with native_loop(world):
        while outcome is Outcome.RUNNING:
            rows = np.empty((due(world.schedule, taken), world.record_size))
            plant.fill(rows)
            senses.perceive(0, rows)
            if taken:
                rewards.append(float(senses.rewards[0].mean()))
            taken += len(rows)
            observed.append(senses.bounded(limits)[0])
            with np.errstate(invalid="ignore"):
                share = rows[-1, given].reshape(senses.robots, senses.axes) / senses.scale[0]
            _, outcome, _ = examine(rows, plant, bound)
            if outcome is Outcome.COMPLETED and taken < world.schedule.count:
                outcome = Outcome.RUNNING
            if outcome is Outcome.RUNNING:
                actions.append(np.clip(share, -1.0, 1.0, out=senses.commanded[0]).copy())
    shape = len(actions), senses.robots, senses.axes
    return LawEpisode(
        np.stack(observed), np.array(actions, np.float32).reshape(shape), np.array(rewards), outcome
    )


@checked
def minari_dataset(
    dataset_id: str,
    scenario: Scenario | Source = "main",
    seeds: Iterable[int] = range(10),
    command: Command = "velocity",
    reward: Reward | None = None,
    **about: Any,
) -> MinariDataset:
    """Fly a scenario by its own law, and store what a policy would have observed and commanded with Minari.

    Args:
        dataset_id: Minari's name for it, such as `escort_mj/main/law-v0`.
        scenario: A checked scenario, or what `load_scenario` takes; by name, the data set can make its
            environment again.
        seeds: One of each episode.
        command: What a policy would command.
        reward: Weights of what is asked; None for those of `Reward`.
        **about: Further arguments of Minari's `create_dataset_from_buffers`, such as `author`.

    Returns:
        The data set, where Minari keeps its own.

    Raises:
        ImportError: If Minari or Gymnasium is missing.
        UsageError: If commands are forces and there is no limit to scale them by.
    """
    try:
        import gymnasium
        from minari import create_dataset_from_buffers
        from minari.data_collector.episode_buffer import EpisodeBuffer
    except ImportError as error:
        raise ImportError(f"{error}; pip install 'escort-mj[minari,rl]' adds what is missing") from None

    mission = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    environment = gymnasium.make(ENVIRONMENT, scenario=scenario, command=command)
    episodes = []
    for seed in seeds:
        flown = law_episode(mission.replace(seed=seed), command, reward)
        last = np.arange(len(flown.actions)) == len(flown.actions) - 1
        complete = flown.outcome is Outcome.COMPLETED
        episodes.append(
            EpisodeBuffer(
                seed=seed,
                observations=flown.observations,
                actions=flown.actions,
                rewards=flown.rewards,
                terminations=last & (not complete),
                truncations=last & complete,
                infos={},
            )
        )
    spec = environment.spec if isinstance(scenario, str) else None
    words = f"{mission.name}: {len(episodes)} missions by the law {mission.law_names}"
    return create_dataset_from_buffers(
        dataset_id,
        episodes,
        env=spec,
        observation_space=environment.observation_space,
        action_space=environment.action_space,
        **{"algorithm_name": mission.law_names, "description": words, "eval_env": spec} | about,
    )
