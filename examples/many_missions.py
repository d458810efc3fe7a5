"""How often does the mission `main` hold with robots of other masses? A thousand runs, at constant memory.

python examples/many_missions.py [RUNS]
"""

import random
import sys

import escort_mj


def missions(count: int):
    """One mission after another, each with a mass and a start of its own; made as they are needed."""
    draw = random.Random(1)
    for seed in range(count):
        yield escort_mj.load_scenario("main", {"seed": seed, "robots.mass": draw.uniform(0.5, 3.0)})


def main() -> None:
    """Runs the missions on all cores, and says what came of them."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    passed, worst = 0, (float("inf"), None)
    for done, run in enumerate(escort_mj.run_many(missions(count)), 1):
        passed += run.passed
        if done % max(count // 10, 1) == 0:
            print(f"{done} of {count} missions", file=sys.stderr, flush=True)
        clearance = run.metrics["obstacle_clearance_min"]["value"] if run.outcome.good else -float("inf")
        worst = min(worst, (clearance, run.scenario.seed))
    print(f"{passed} of {count} missions passed; least clearance {worst[0]:.3f} m, with seed {worst[1]}")


if __name__ == "__main__":
    main()
