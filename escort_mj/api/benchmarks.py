"""Missions on worlds that others published."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Annotated

from escort_mj.api import load_scenario
from escort_mj.errors import UsageError
from escort_mj.progress import Progress, shown_progress
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import Bound, Count, Positive, Seed, Source, checked
from escort_mj.study.benchmark.gcbf import BASES, Benchmark, run_benchmark
from escort_mj.study.benchmark.worlds import draw_worlds, read_worlds
from escort_mj.study.engine.parallel import cores


@checked
def gcbf(
    worlds: str | os.PathLike[str] | None = None,
    *,
    agents: Count | None = None,
    area: Positive = 4.0,
    obstacles: Annotated[int, Bound(0)] = 8,
    travel: Positive | None = None,
    episodes: Count | None = None,
    seed: Seed = 0,
    environment: str = "DoubleIntegrator",
    scenario: Scenario | Source | None = None,
    overrides: Sequence[str] = (),
    workers: Count | None = None,
    progress: bool | Progress | None = None,
) -> Benchmark:
    """Fly the worlds of the GCBF+ benchmark.

    Args:
        worlds: A file of worlds, or shipped ones: n8 or n32; None for n8, or for drawn ones with `agents`.
        agents: Number of agents of worlds that are drawn by the published rules; None: none are drawn.
        area: Side of the square of drawn worlds [m].
        obstacles: Number of boxes of drawn worlds.
        travel: Farthest that a goal of a drawn world is from its start along an axis [m]; None for anywhere.
        episodes: Number of worlds; None for all of a file, or 32 drawn ones.
        seed: Seed of drawn worlds.
        environment: Published dynamics of drawn worlds: DoubleIntegrator, LinearDrone or CrazyFlie.
        scenario: Scenario whose behaviors, law and sensing fly, or any source that `load_scenario` accepts;
            None for the one of the environment.
        overrides: Texts `key.path=value` for the scenario.
        workers: Number of threads; None for one per core.
        progress: Function of episodes done and episodes in all; True shows a bar, False none, None decides.

    Returns:
        Shares of agents that are safe, reach their goals, and both; one row per episode.

    Raises:
        UsageError: If there are no such worlds, or worlds are both given and drawn.
        ScenarioError: If the scenario does not fit the worlds, with all faults.
    """
    if worlds is not None and agents is not None:
        raise UsageError("worlds and agents: found both; give a file of worlds, or what to draw")
    if agents is not None:
        count = 32 if episodes is None else episodes
        drawn = draw_worlds(agents, area, obstacles, count, seed, environment, travel)
    else:
        drawn = read_worlds("n8" if worlds is None else worlds)
        drawn = drawn.model_copy(update={"episodes": drawn.episodes[:episodes]})
    scenario = BASES[drawn.environment] if scenario is None else scenario
    base = scenario if isinstance(scenario, Scenario) else load_scenario(scenario, overrides)
    with shown_progress("flying", " episodes", progress) as update:
        return run_benchmark(drawn, base, cores() if workers is None else workers, update)
