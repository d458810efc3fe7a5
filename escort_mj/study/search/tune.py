"""Values of scenario keys tuned to metrics, and compared with the scenario's own on seeds held out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from escort_mj import stopping
from escort_mj.errors import ScenarioError, UsageError
from escort_mj.files import write_json, write_text
from escort_mj.progress import Progress, unseen
from escort_mj.recognize import BEST
from escort_mj.study.engine.backends import Backend
from escort_mj.study.engine.store import Row
from escort_mj.study.engine.work import Job
from escort_mj.study.search.evaluate import Evaluator, Point, base_of, mean_of, robustness
from escort_mj.study.search.optimizer import Optimizer, PointResult
from escort_mj.study.search.tuned import Gain, Tuned, TunedPoint, trials_csv
from escort_mj.study.sweeps.definition import MetricBound, Tune
from escort_mj.study.sweeps.design import Design
from escort_mj.study.sweeps.statistics import Array, bootstrap, pareto

TRIALS, SUMMARY = "trials.csv", "tune.json"


def tune_design(design: Design, out: Path, backend: Backend[Job, Row], progress: Progress = unseen) -> Tuned:
    """Tunes what a study says, and writes the best as a scenario that runs.

    Args:
        design: A study with a section `tune`.
        out: Folder of its results; tuning again finds its runs there and goes on where it was.
        backend: Where to compute.
        progress: Called with the trials made and all.

    Raises:
        ScenarioError: If the study has no such section, or a key of it is none.
        UsageError: If Optuna is not installed, or no point tried keeps every constraint.
    """
    search = design.study.tune
    if search is None:
        raise ScenarioError([design.file.fault("has no section tune, which says what to tune", "study")])
    with Evaluator(design, out, backend) as evaluator, stopping.keeping(evaluator.kept):
        own, trials = _tried(evaluator, search, progress)
        write_text(out / TRIALS, trials_csv(search, own, trials, front := _front(search, trials)))
        if not front:
            raise UsageError(
                f"{design.file.path}: none of {len(trials)} trials keeps every constraint; "
                f"{out / TRIALS} says which are broken"
            )
        gains, failed = _compared(evaluator, search, trials[front[0]])
        found = Tuned(own, tuple(trials), tuple(front), gains, failed, evaluator.asked, evaluator.made)
        best = found.best.point
        title = f"Tuned by escort-mj tune {design.study.study}: {_aim(search)}"
        evaluator.write(out / BEST, best, evaluator.scenario(best), title)
    told = {metric: gain._asdict() for metric, gain in gains.items()}
    write_json(out / SUMMARY, asdict(found) | {"best": best, "trials": len(trials), "gains": told})
    return found


def _aim(search: Tune) -> str:
    """What tuning is after, in words."""
    aims = " and ".join(f"{objective.goal} {objective.key}" for objective in search.objectives)
    return aims + "".join(f", {_bound(bound)}" for bound in search.bounds)


def _bound(bound: MetricBound) -> str:
    words = [f"{key.replace('_', ' ')} {value:g}" for key in ("at_most", "at_least")
             if (value := getattr(bound, key)) is not None]  # fmt: skip
    if bound.at_most_own is not None:
        words.append(f"at most {bound.at_most_own:g} times its own")
    return f"{bound.key} {' and '.join(words)}"


def _tried(evaluator: Evaluator, search: Tune, progress: Progress) -> tuple[TunedPoint, list[TunedPoint]]:
    """Tries as many points as wanted, the scenario's own values first."""
    own_rows = evaluator([{}])[0]
    own = _trial(evaluator, search, {}, own_rows, own_rows or [])
    goals = [objective.goal for objective in search.objectives]
    optimizer = Optimizer(search.over, search.method, search.seed, search.batch, goals)
    base = {key: base_of(evaluator.design, key) for key in search.over}
    if all(
        value is not None and search.over[key].low <= value <= search.over[key].high
        for key, value in base.items()
    ):
        optimizer.suggest({key: value for key, value in base.items() if value is not None})
    trials: list[TunedPoint] = []

    def weigh(point: Point, rows: list[Row] | None) -> PointResult:
        trials.append(trial := _trial(evaluator, search, point, rows, own_rows or []))
        return PointResult(trial.values, trial.violations)

    for _ in evaluator.follow(optimizer, lambda: min(search.batch, search.trials - len(trials)), weigh):
        progress(len(trials), search.trials)
    return own, trials


def _trial(
    evaluator: Evaluator, search: Tune, point: Mapping[str, float], rows: list[Row] | None, own: list[Row]
) -> TunedPoint:
    """Sums up the runs of a point."""
    if rows is None:
        return TunedPoint(dict(point), None, {}, {})
    violations = {}
    if search.verdicts:
        duration = evaluator.scenario(point).duration
        violations["verdicts"] = -min(robustness(row, duration).value for row in rows)
    bounded = {bound.key: mean_of(rows, bound.key) for bound in search.bounds}
    for bound in search.bounds:
        value, name = bounded[bound.key], _bound(bound)
        most = [bound.at_most] if bound.at_most is not None else []
        if bound.at_most_own is not None:
            most.append(bound.at_most_own * mean_of(own, bound.key))
        excesses = [_excess(value, limit) for limit in most]
        if bound.at_least is not None:
            excesses.append(-_excess(value, bound.at_least))
        violations[name] = max(excesses)
    values = tuple(mean_of(rows, objective.key) for objective in search.objectives)
    numbers = all(map(math.isfinite, (*values, *violations.values())))
    return TunedPoint(dict(point), values if numbers else None, bounded, violations)


def _excess(value: float, limit: float) -> float:
    """How far a value is above a limit, by the size of both."""
    return (value - limit) / (abs(value) + abs(limit) or 1.0)


def _front(search: Tune, trials: Sequence[TunedPoint]) -> list[int]:
    """Places of the feasible trials that no other betters in all objectives, by the first objective."""
    signs = [1.0 if objective.goal == "minimize" else -1.0 for objective in search.objectives]
    costs = {
        place: tuple(sign * value for sign, value in zip(signs, trial.values or (), strict=True))
        for place, trial in enumerate(trials)
        if trial.feasible
    }
    on_front = pareto(np.reshape(list(costs.values()), (len(costs), len(signs))))
    best: dict[tuple[float, ...], int] = {}
    for (place, cost), kept in zip(costs.items(), on_front, strict=True):
        if kept:
            best.setdefault(cost, place)
    return [place for _, place in sorted(best.items())]


def _compared(
    evaluator: Evaluator, search: Tune, best: TunedPoint
) -> tuple[dict[str, Gain], tuple[int, int]]:
    """The best values against the scenario's own, on seeds that tuning has not seen."""
    first = evaluator.design.seeds[-1] + 1
    seeds = range(first, first + search.held_out)
    if not search.held_out:
        return {}, (0, 0)
    own, tuned = evaluator([{}, best.point], seeds)
    assert own is not None and tuned is not None, "both were possible with other seeds"
    metrics = dict.fromkeys([*(o.key for o in search.objectives), *(b.key for b in search.bounds)])
    gains = {metric: gain for metric in metrics if (gain := _gain(own, tuned, metric)) is not None}
    return gains, (sum(not row.passed for row in own), sum(not row.passed for row in tuned))


def _gain(own: Sequence[Row], tuned: Sequence[Row], metric: str) -> Gain | None:
    """One metric of runs in pairs; None where no pair has two finite values."""
    values = [(a.metrics.get(metric), b.metrics.get(metric)) for a, b in zip(own, tuned, strict=True)]
    known = np.array([(a, b) for a, b in values if a is not None and b is not None], float).reshape(-1, 2)
    pairs = known[np.isfinite(known).all(axis=1)]
    if not len(pairs) or not pairs[:, 0].mean():
        return None
    low, high = bootstrap(pairs, _changes)
    before, after = (float(mean_) for mean_ in pairs.mean(axis=0))
    smaller, (own_never, best_never) = known[:, 1] < known[:, 0], np.isinf(known).sum(axis=0)
    never = int(own_never), int(best_never)
    return Gain(before, after, after / before - 1.0, low, high, int(smaller.sum()), len(known), never)


def _changes(draws: Array) -> Array:
    """Relative changes of the mean from the first column to the second; draws are (resamples, pairs, 2)."""
    own, best = np.moveaxis(draws.mean(axis=1), -1, 0)
    with np.errstate(divide="ignore", invalid="ignore"):  # draws of nothing but zeros
        return np.asarray(best / own - 1.0)
