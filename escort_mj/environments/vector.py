"""Many missions of a scenario as one Gymnasium environment, stepped natively in threads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

try:
    from gymnasium.utils import EzPickle
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ImportError as error:
    raise ImportError(f"{error}; pip install 'escort-mj[rl]' adds what is missing") from None

from escort_mj.environments.draws import SET, Values, values_in
from escort_mj.environments.fleet import Fleet, OneSide
from escort_mj.environments.own import Parts
from escort_mj.environments.rivals import RivalReward
from escort_mj.environments.seeds import Seeds
from escort_mj.environments.senses import Command, Reward, Seen
from escort_mj.environments.single import spaces_of
from escort_mj.errors import UsageError
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import (
    SEEDS,
    Count,
    Source,
    argument_error,
    checked,
    numbers,
    shape_of,
    whole_number,
)

NUMBERS = (bool, int, float)
Flags = NDArray[np.bool_]
Step = tuple[Seen, NDArray[np.float64], Flags, Flags, dict[str, Any]]


class EscortVectorEnv(VectorEnv[Seen, NDArray[np.float32], NDArray[Any]], EzPickle):
    """N missions that differ by seed; each has the bits of an `EscortEnv` with its seed.

    Attributes:
        fleet: The missions; `fleet.snapshot(k)` and `fleet.restore(k, snapshot)` put any of them at any
            moment, `fleet.missions[k].push` pushes a robot.
    """

    @checked
    def __init__(
        self,
        num_envs: Count = 1,
        scenario: Scenario | Source = "main",
        command: Command = "velocity",
        reward: Reward | None = None,
        threads: Count | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        side: OneSide = "robots",
        rival_reward: RivalReward | None = None,
        sample: Mapping[str, Any] | None = None,
        own: Parts = (),
    ) -> None:
        """Prepare missions.

        Args:
            num_envs: N.
            scenario: A checked scenario, or what `load_scenario` takes.
            command: As of `Simulation`.
            reward: As of `Simulation`.
            threads: How many step missions; None for one per core. It changes no bit.
            autoreset_mode: What a mission does that has ended: it begins again in the next step, in the same
                step, or when `reset` is called with its place in `options["reset_mask"]`.
            side: As of `EscortEnv`.
            rival_reward: As of `Simulation`.
            sample: As of `Simulation`; each mission has values of its own.
            own: As of `Simulation`; one object serves all missions.

        Raises:
            UsageError: If an argument is not of its kind, or there is to be no mission, or forces are to be
                commanded without a limit, or opponents and there are none, or both sides.
            ScenarioError: If what `sample` has is impossible.
        """
        given = num_envs, scenario, command, reward, threads, autoreset_mode, side, rival_reward, sample, own
        EzPickle.__init__(self, *given)
        try:
            self.autoreset_mode = AutoresetMode(autoreset_mode)
        except ValueError:
            modes = ", ".join(mode.value for mode in AutoresetMode)
            raise argument_error("autoreset_mode", autoreset_mode, f"one of {modes}") from None
        self.fleet = Fleet(scenario, num_envs, command, reward, threads, side, rival_reward, sample, own)
        self.num_envs = num_envs = int(num_envs)
        team = self.fleet.members, self.fleet.senses.axes
        self.metadata = {"render_modes": [], "autoreset_mode": self.autoreset_mode}
        self.single_observation_space, self.single_action_space = spaces_of(self.fleet.limits, *team)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._seeds = [Seeds(self.fleet.scenario.seed + k) for k in range(num_envs)]
        self._rest = np.zeros((num_envs, *team))
        self._rewards = np.zeros((num_envs, self.fleet.members))
        self._begun = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Seen, dict[str, Any]]:
        """Start missions.

        Args:
            seed: Of mission k it is `seed + k`, or the k-th of several; without one, its generator goes on,
                as that of `EscortEnv` does. At first mission k has the scenario's seed plus k.
            options: Its `reset_mask`, shape (N,), says which missions start; all others stay where they are.
                `set` is a table of scenario keys and their values in the missions that start.

        Returns:
            What is observed, and infos: `set`, what is drawn and set in each mission that starts, if anything
            is.

        Raises:
            UsageError: If seeds or options are of another kind, or values make missions of another shape.
            ScenarioError: If values are impossible.
        """
        mask, values = np.ones(self.num_envs, dtype=bool), values_in(options, ("reset_mask",))
        if options and "reset_mask" in options:
            given = options["reset_mask"]
            mask = np.asarray(given) if shape_of(given) == mask.shape else np.zeros(0)
            if mask.dtype != np.bool_ or not mask.any():
                raise argument_error("reset_mask", given, f"{self.num_envs} flags, at least one set")
        seeds = self._seeds_of(seed)
        started = [int(k) for k in np.flatnonzero(mask)]
        told = self._begin(started, seeds, values)
        self._begun = True
        self.fleet.advance(started, self._rest)
        return self.fleet.observe(), told

    def step(self, actions: NDArray[np.float32]) -> Step:
        """Advance every mission to its next sample; see Gymnasium's `AutoresetMode` for those that had ended.

        Args:
            actions: Shape (N, n, p), of n robots or opponents.

        Returns:
            Observations (N, n, width), rewards (N,), terminations (N,), truncations (N,), infos: `outcome`,
            the `rewards` of each robot or opponent (N, n), whose mean is the reward, of robots `touching` and
            `reward_terms` by name, each (N, n), of opponents `comes`, and in same-step mode `final_obs` and
            `final_info` of missions that ended; of missions that begin again `set`, as of `reset`.

        Raises:
            UsageError: If missions were not reset, if shapes differ, or if a number is not finite; the
                missions do not change.
        """
        given = numbers(
            actions, "actions", self._rest.shape, "one row per robot of each mission, from -1 to 1"
        )
        fresh = self._over
        again, told = fresh.any(), dict[str, Any]()
        if again:
            if self.autoreset_mode is not AutoresetMode.NEXT_STEP or not self._begun:
                raise UsageError(f"missions {np.flatnonzero(fresh).tolist()} have ended: call reset")
            told = self._begin([int(k) for k in np.flatnonzero(fresh)], [None] * self.num_envs)
            given = np.where(fresh[:, None, None], 0.0, given)
        self._rewards = self.fleet.advance(range(self.num_envs), given).copy()
        rewards = self._rewards.mean(axis=1)
        if again:
            rewards[fresh] = 0.0
        truncated, terminated = self.fleet.completed.copy(), self.fleet.broken | self.fleet.decided
        infos = self._infos(~fresh) | told
        observed = self.fleet.observe()
        if (terminated | truncated).any() and self.autoreset_mode is AutoresetMode.SAME_STEP:
            observed, infos = self._begin_again(observed, infos)
        return observed, rewards, terminated, truncated, infos

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads."""
        self.fleet.close()

    @property
    def _over(self) -> Flags:
        """Which missions have ended, or have not begun."""
        fleet = self.fleet
        return ~fleet.begun | fleet.completed | fleet.broken | fleet.decided

    def _seeds_of(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        """Return the seed of each mission; None for those whose generator goes on."""
        count = self.num_envs
        if seed is None:
            return [None] * count
        if not isinstance(seed, Sequence | np.ndarray) or isinstance(seed, str):
            first = whole_number(seed, "seed", f"{SEEDS}, or {count} of them", 0)
            return [first + k for k in range(count)]
        if len(seed) != count:
            raise UsageError(f"seed: found {len(seed)} seeds; expected {count}, one per mission")
        return [None if each is None else whole_number(each, "seed", SEEDS, 0) for each in seed]

    def _begin(
        self, missions: Sequence[int], seeds: Sequence[int | None], given: Values | None = None
    ) -> dict[str, Any]:
        """Put missions at their starts, and return what is said of their values, as Gymnasium batches it."""
        for k in missions:
            self.fleet.begin(k, self._seeds[k].next(seeds[k]), given)
        those, told = np.zeros(self.num_envs, dtype=bool), dict[str, Any]()
        those[missions] = True
        for key in self.fleet.values[missions[0]]:
            found = [self.fleet.values[k][key] for k in missions]
            kinds = {type(value) for value in found}
            kind = max(kinds, key=NUMBERS.index) if kinds <= {*NUMBERS} else object
            told[key] = (
                np.zeros(self.num_envs, kind) if kind in NUMBERS else np.full(self.num_envs, None, kind)
            )
            for k, value in zip(missions, found, strict=True):
                told[key][k] = value
        return _batched({SET: told}, those) if told else {}

    def _infos(self, those: Flags) -> dict[str, Any]:
        """Return what is said of some missions beside observations, as Gymnasium batches it."""
        if not those.any():
            return {}
        outcomes = self.fleet.words.copy()
        outcomes[~those] = None
        found: dict[str, Any] = {"outcome": outcomes, "rewards": self._rewards.copy()}
        if self.fleet.rivals:
            found["comes"] = np.array([each.comes for each in self.fleet.rivals])
        else:
            found |= {
                "touching": self.fleet.touching.copy(),
                "reward_terms": self.fleet.senses.reward_terms(),
            }
        return _batched(found, those)

    def _begin_again(self, observed: Seen, infos: dict[str, Any]) -> tuple[Seen, dict[str, Any]]:
        """Start missions that have just ended, and put how they ended into the infos."""
        over = self._over
        final = np.full(self.num_envs, None, dtype=object)
        for k in np.flatnonzero(over):
            final[k] = observed[k]
        ended = self._infos(over)
        going_on = self._infos(~over)
        started = [int(k) for k in np.flatnonzero(over)]
        told = self._begin(started, [None] * self.num_envs)
        self.fleet.advance(started, self._rest)
        extra = told | {
            "final_obs": final,
            "_final_obs": over,
            "final_info": ended,
            "_final_info": over.copy(),
        }
        return self.fleet.observe(), going_on | extra


def _batched(found: dict[str, Any], those: Flags) -> dict[str, Any]:
    """Return what was found of all missions as Gymnasium batches it of some: zeros for others, and flags."""
    batched, whole = dict[str, Any](), those.all()
    for name, value in found.items():
        if isinstance(value, dict):
            value = _batched(value, those)
        elif not whole and value.dtype != object:
            value[~those] = 0
        batched |= {name: value, f"_{name}": those.copy()}
    return batched
