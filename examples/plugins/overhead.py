"""Measure the overhead of a plugin law over the same built-in law: python examples/plugins/overhead.py.

The leaky law without leak is APD-SMC without its switching term. Three plants take turns, a short stretch of
steps each, so that other load on the machine affects them equally. The result is the median of the ratios.
"""

import time
from pathlib import Path
from statistics import median

from escort_mj import api
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant

HERE = Path(__file__).parent
STEPS = 250  # a stretch
ROUNDS = 80
GAINS = "proportional_gain: 30, derivative_gain: 50, adaptation_rate: 20"
BUILT_IN = f"{{law: apd_smc, {GAINS}, switching_gain: 0, initial_estimate: 0}}"
PLUGIN = f"{{law: leaky, {GAINS}, leak: 0}}"


def plant(controller: str, robots: int, numpy: bool = False) -> Plant:
    """A plant of the storm with a controller."""
    overrides = [f"controller={controller}", f"robots.count={robots}", "mission.radius=20"]
    overrides += ["duration=1000", "expect=[]"]
    scenario = api.load_scenario(HERE / "storm.yaml", overrides)
    law = type(scenario.controller)
    if numpy:
        law.compiled = False
    world = build(scenario)
    if numpy:
        law.compiled = True
    return Plant(world)


def main() -> None:
    """Measures teams of several sizes."""
    print("robots  built in [us/step]  compiled / built in  NumPy / built in")
    for robots in (5, 20, 100):
        plants = [plant(BUILT_IN, robots), plant(PLUGIN, robots), plant(PLUGIN, robots, numpy=True)]
        rounds = []
        with native_loop(*(each.world for each in plants)):
            for _ in range(ROUNDS):
                rounds.append([])
                for each in plants:
                    start = time.perf_counter()
                    each.step(STEPS)
                    rounds[-1].append((time.perf_counter() - start) / STEPS)
        rounds = rounds[ROUNDS // 4 :]  # the first ones compile, and find their feet
        alone = 1e6 * median(times[0] for times in rounds)
        compiled = median(times[1] / times[0] for times in rounds)
        numpy = median(times[2] / times[0] for times in rounds)
        print(f"{robots:6d}  {alone:18.2f}  {compiled:19.3f}  {numpy:16.2f}")


if __name__ == "__main__":
    main()
