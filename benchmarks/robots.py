"""`python -m benchmarks.robots`: kinds of robots under the sliding laws, as the tables of docs/robots.md."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from typing import Any, NamedTuple

os.environ.setdefault("MUJOCO_GL", "disable")

import numpy as np  # noqa: E402

from benchmarks.document import publish, table, wants_docs  # noqa: E402
from escort_mj.api import load_scenario  # noqa: E402
from escort_mj.laws import LAWS  # noqa: E402
from escort_mj.measuring import measure_over
from escort_mj.mission import fly  # noqa: E402
from escort_mj.record.window import Span
from escort_mj.study.engine.parallel import cores, side_by_side  # noqa: E402

PAGE = "robots.md"
KINDS = ("slung", "loaded", "quadrotor", "mixed")
NAMES = ("apd_smc", "asmc", "pd_smc")
SOFT = {"proportional_gain": 12, "derivative_gain": 12, "adaptation_rate": 6, "slope": 10}
SEEDS, MORE_SEEDS = 5, 20
LAST = 5.0  # s: robots have passed the last obstacle before
PLAIN = {"robots.kind": "point_mass"}
DRIVEN = {  # kinds that cannot move sideways: their gains as far as laws have them
    "diff_drive": {"proportional_gain": 12, "derivative_gain": 12, "adaptation_rate": 6, "slope": 10},
    "surface_vessel": {"proportional_gain": 5, "derivative_gain": 15, "adaptation_rate": 2, "slope": 1},
}

# One hidden effect at a time, on the mission of slung robots with the paper's gains.
TROUBLES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("none: point masses", PLAIN),
    *((f"payload {m:g} times the mass", {"robots.kind.payload": m}) for m in (0.2, 0.5, 1.0, 2.0, 5.0)),
    *((f"lag of {1e3 * s:g} ms", PLAIN | {"robots.actuators.lag": s}) for s in (0.01, 0.02, 0.05, 0.1)),
    *((f"dead zone {zone:g} N", PLAIN | {"robots.actuators.dead_zone": zone}) for zone in (0.1, 1.0, 5.0)),
    *((f"gains off by {100 * e:g} %", PLAIN | {"robots.actuators.gain_error": e}) for e in (0.1, 0.3, 0.6)),
)  # fmt: skip


class Trial(NamedTuple):
    """One mission to fly: a scenario, keys that differ, and the seed."""

    scenario: str
    keys: tuple[tuple[str, Any], ...]
    seed: int


class Result(NamedTuple):
    """What came of it."""

    passed: bool
    outcome: str
    error: float  # mean of | |q - c| - radius | over the last 5 s [m]
    obstacles: float  # least clearance to obstacles [m]
    robots: float  # and to teammates [m]
    contacts: float
    saturated: float
    chattering: float  # in the tail [N/s]


def attempt(trial: Trial) -> Result:
    """Flies one mission."""
    keys = {key: dict(value) if isinstance(value, tuple) else value for key, value in trial.keys}
    run = fly(load_scenario(f"robots/{trial.scenario}", {**keys, "seed": trial.seed}))
    trace = run.trace
    last = trace["time"].values >= float(trace["time"][-1]) - LAST
    offset = trace["q"].values[last] - trace["target_position"].values[last, None]
    error = np.abs(np.linalg.norm(offset, axis=2) - trace.attrs["mission_radius"]).mean()
    of = {name: run.metrics[name]["value"] for name in METRICS}
    of["chattering"] = measure_over("chattering", trace, Span("tail")).value
    return Result(run.passed, run.outcome.value, float(error), *of.values())


METRICS = ("obstacle_clearance_min", "robot_clearance_min", "contacts", "saturated_share")


def gains(law: str, values: dict[str, Any]) -> tuple[tuple[str, Any], ...]:
    """A law with gains as far as it has them, and its own defaults: the paper's."""
    (kind,) = (each for each in LAWS if each.model_fields["law"].default == law)
    chosen = {key: value for key, value in values.items() if key in kind.model_fields}
    return tuple({"law": law, **chosen}.items())


def missions() -> dict[tuple[str, str, str], list[Trial]]:
    """Kind, law and gains, and the missions of each."""
    return {
        (kind, law, "softer" if soft else "the paper's"): [
            Trial(kind, (("controller", gains(law, SOFT if soft else {})),), seed)
            for seed in range(1, SEEDS + 1)
        ]
        for kind in KINDS
        for law in NAMES
        for soft in ((False,) if kind in ("slung", "loaded") else (True, False))
    }


def driven() -> dict[tuple[str, str, str], list[Trial]]:
    """Return the same of kinds that cannot move sideways, with their scenarios' gains and with `auto`."""
    return {
        (kind, law, name): [Trial(kind, (("controller", chosen),), seed) for seed in range(1, MORE_SEEDS + 1)]
        for kind, own in DRIVEN.items()
        for law in NAMES
        for name, chosen in (
            ("the scenario's", gains(law, own if law != "asmc" else {"slope": own["slope"]})),
            ("auto", (("law", law), ("gains", "auto"))),
        )
    }


def troubles() -> dict[tuple[str], list[Trial]]:
    """Return the hidden effects and the missions of each."""
    return {
        (name,): [Trial("slung", tuple(keys.items()), seed) for seed in range(1, SEEDS + 1)]
        for name, keys in TROUBLES
    }


def rows(cases: dict[Any, list[Trial]], found: dict[Trial, Result]) -> Iterator[list[str]]:
    """One row per case: what it is, and what came of it."""
    for case, trials in cases.items():
        results = [found[trial] for trial in trials]
        flown = [result for result in results if result.outcome == "completed"]
        cells = [f"{sum(result.passed for result in results)} of {len(results)}"]
        if not flown:
            yield [*case, *cells, "none completes", "-", "-", "-", "-"]
            continue
        errors = [1e3 * result.error for result in flown]
        touched = sum(result.contacts > 0 for result in results)
        yield [
            *case,
            *cells,
            f"{np.median(errors):.2g} ({max(errors):.2g})",
            f"{min(result.obstacles for result in flown):.2f}" + (f" ({touched} touched)" if touched else ""),
            f"{min(result.robots for result in flown):.2f}",
            f"{100 * np.mean([result.saturated for result in flown]):.1f} %",
            f"{np.median([result.chattering for result in flown]):.0f}",
        ]


def main(arguments: Any = None) -> None:
    """Flies all missions on all cores, prints the tables, and writes them into the docs if asked."""
    write = wants_docs(__doc__, PAGE, arguments)

    def progress(done: float, total: float) -> None:
        if sys.stderr.isatty():
            print(f"\r{done:.0f}/{total:.0f} missions", end="", file=sys.stderr, flush=True)

    cases, more, sideways = missions(), troubles(), driven()
    todo = list(
        dict.fromkeys(
            trial for each in (cases, more, sideways) for trials in each.values() for trial in trials
        )
    )
    found = dict(zip(todo, side_by_side(attempt, todo, cores(), progress), strict=True))
    measured = [
        "verdicts passed",
        "error in the last 5 s, worst [mm]",
        "to obstacles [m]",
        "to robots [m]",
        "at a limit",
        "N/s",
    ]
    tables = {
        "kinds": table(["robots", "law", "gains", *measured], rows(cases, found)),
        "driven": table(["robots", "law", "gains", *measured], rows(sideways, found)),
        "troubles": table(["hidden effect", *measured], rows(more, found)),
    }
    publish(PAGE, tables, write)


if __name__ == "__main__":
    main()
