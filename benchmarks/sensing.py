"""`python -m benchmarks.sensing`: what delays and dropouts cost, as the tables of docs/sensing.md."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from typing import Any, NamedTuple

os.environ.setdefault("MUJOCO_GL", "disable")

import numpy as np  # noqa: E402

from benchmarks.document import publish, table, wants_docs  # noqa: E402
from escort_mj import load_scenario  # noqa: E402
from escort_mj.mission import fly  # noqa: E402
from escort_mj.study.engine.parallel import cores, side_by_side  # noqa: E402

PAGE = "sensing.md"
DELAYS = (0, 2, 4, 6, 8, 10, 14, 20, 30, 50, 100)  # [steps]
DROPOUTS = (0.0, 0.05, 0.5, 0.9, 0.98)
SEEDS = 3
LAST = 10.0  # [s]
STEP = 0.002
CHANNELS = {"own": ("position", "velocity"), "own velocity": ("velocity",), "own position": ("position",)}
SCENARIO = "paper/case1_2d"


class Trial(NamedTuple):
    """One mission to fly."""

    channels: str  # key of CHANNELS
    delay: int  # [steps]
    dropout: float
    law: str
    seed: int


class Result(NamedTuple):
    """What came of it."""

    completed: bool
    radius_error: float  # mean over robots and the last 10 s [m]
    effort: float  # rms force of a robot over the last 10 s [N]


def attempt(trial: Trial) -> Result:
    """Flies one mission."""
    settings = [f"seed={trial.seed}", f"controller={trial.law}", "expect=[]", f"physics.timestep={STEP}"]
    for channel in CHANNELS[trial.channels]:
        settings.append(f"sensing.{channel}.delay={trial.delay * STEP}")
        settings.append(f"sensing.{channel}.dropout={trial.dropout}")
    run = fly(load_scenario(SCENARIO, settings))
    if not run.outcome.good:
        return Result(False, np.inf, np.inf)
    trace: Any = run.trace
    last = trace["time"].values >= trace["time"].values[-1] - LAST
    offset = (trace["q"] - trace["target_position"]).values[last]
    error = np.abs(np.linalg.norm(offset, axis=2) - trace.attrs["mission_radius"])
    force = np.sqrt(np.mean(np.sum(trace["force"].values[last] ** 2, axis=2)))
    return Result(True, float(error.mean()), float(force))


def cell(results: list[Result]) -> str:
    """Mean error [mm] and rms force [N] over the seeds; who did not complete is counted."""
    if not all(result.completed for result in results):
        return f"diverged ({sum(not result.completed for result in results)}/{len(results)})"
    error, force = np.mean([result[1:] for result in results], axis=0)
    return f"{1e3 * error:.3g} ({force:.2g})"


def delay_trials() -> list[Trial]:
    """Every delay of every group of channels, and of the laws beside APD-SMC with everything delayed."""
    grid = [("apd_smc", name) for name in CHANNELS] + [(law, "own") for law in ("asmc", "pd_smc")]
    return [
        Trial(name, delay, 0.0, law, seed)
        for law, name in grid
        for delay in DELAYS
        for seed in range(1, SEEDS + 1)
    ]


def dropout_trials() -> list[Trial]:
    """Every dropout of the robots' own channels and of the target's, at three delays."""
    return [
        Trial("own", delay, dropout, "apd_smc", seed)
        for dropout in DROPOUTS
        for delay in (0, 4)
        for seed in range(1, SEEDS + 1)
    ]


def rows(found: dict[Trial, Result], first: str, columns: list[dict[str, Any]]) -> Iterator[list[str]]:
    """One row per value of a field of the trials; a column has the trials that agree with it."""
    for value in dict.fromkeys(getattr(trial, first) for trial in found):
        cells = []
        for column in columns:
            wanted = {first: value, **column}
            cells.append(
                cell([r for t, r in found.items() if all(getattr(t, k) == v for k, v in wanted.items())])
            )
        yield [f"{1e3 * STEP * value:g}" if first == "delay" else f"{100 * value:g} %", *cells]


def main(arguments: Any = None) -> None:
    """Flies all missions on all cores, prints the tables, and writes them into the docs if asked."""
    write = wants_docs(__doc__, PAGE, arguments)

    def progress(done: float, total: float) -> None:
        if sys.stderr.isatty():
            print(f"\r{done:.0f}/{total:.0f} missions", end="", file=sys.stderr, flush=True)

    delays, dropouts = delay_trials(), dropout_trials()
    results = side_by_side(attempt, [*delays, *dropouts], cores(), progress)
    delayed = dict(zip(delays, results, strict=False))
    dropped = dict(zip(dropouts, results[len(delays) :], strict=True))
    delay_columns = [{"law": "apd_smc", "channels": name} for name in CHANNELS]
    delay_columns += [{"law": law, "channels": "own"} for law in ("asmc", "pd_smc")]
    dropout_columns = [{"channels": name, "delay": delay} for name in ("own",) for delay in (0, 4)]
    head = [f"{column['law']}: {column['channels']}" for column in delay_columns]
    publish(
        PAGE,
        {
            "delay": table(["delay [ms]", *head], rows(delayed, "delay", delay_columns)),
            "dropout": table(
                ["dropout", *(f"{c['channels']}, {1e3 * STEP * c['delay']:g} ms" for c in dropout_columns)],
                rows(dropped, "dropout", dropout_columns),
            ),
        },
        write,
    )


if __name__ == "__main__":
    main()
