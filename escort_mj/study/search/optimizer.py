"""Points that an optimizer wants to be tried: Optuna, asked in batches and told in order.

With the same seed and the same answers it asks the same questions. So a search that was broken off is simply
made again: the runs that it had made are found in the store, and it goes on where it was.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

from escort_mj.errors import UsageError
from escort_mj.study.sweeps.values import Range

Point = dict[str, float | int]
Goal = Literal["minimize", "maximize"]
DIGITS = 4  # of the numbers that are tried


class PointResult(NamedTuple):
    """What came of a point.

    Attributes:
        values: What is to become small or large; None where the point cannot be tried.
        violations: By how much it breaks each constraint; 0 and less is none.
    """

    values: Sequence[float] | None
    violations: Mapping[str, float] = {}  # noqa: RUF012  it is not changed


class Optimizer:
    """An optimizer over a box."""

    def __init__(
        self,
        box: Mapping[str, Range],
        method: str,
        seed: int,
        batch: int,
        goals: Sequence[Goal] = ("minimize",),
    ) -> None:
        """Set an optimizer up.

        Args:
            box: Keys and their ranges.
            method: `cmaes`, `tpe`, `nsga2` or `random`.
            seed: Of its choices.
            batch: Points asked for at once: the population of CMA-ES and NSGA-II, if that is not too small.
            goals: `minimize` or `maximize` for each value that it is told.

        Raises:
            UsageError: If Optuna is not installed.
        """
        try:
            import optuna
        except ImportError:
            raise UsageError(
                "tune and falsify need Optuna, which is not installed; pip install 'escort-mj[tune]' adds it"
            ) from None
        optuna.logging.set_verbosity(optuna.logging.ERROR)
        self._optuna, self._trials = optuna, list[Any]()
        self._spread: dict[str, Any] = {}
        for key, bounds in box.items():
            log = bounds.scale == "log"
            if bounds.whole:
                least, most = math.ceil(bounds.low), math.floor(bounds.high)
                self._spread[key] = optuna.distributions.IntDistribution(least, most, log=log)
            else:
                self._spread[key] = optuna.distributions.FloatDistribution(bounds.low, bounds.high, log=log)
        samplers: dict[str, Any] = {
            "cmaes": lambda: optuna.samplers.CmaEsSampler(
                seed=seed, popsize=max(batch, 4), n_startup_trials=1, warn_independent_sampling=False
            ),
            "tpe": lambda: optuna.samplers.TPESampler(seed=seed, multivariate=True, constant_liar=True),
            "nsga2": lambda: optuna.samplers.NSGAIISampler(seed=seed, population_size=max(batch, 16)),
            "random": lambda: optuna.samplers.RandomSampler(seed=seed),
        }
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            self._study = optuna.create_study(sampler=samplers[method](), directions=list(goals))

    def suggest(self, point: Mapping[str, float | int]) -> None:
        """Add a given point as the next one to try."""
        self._study.enqueue_trial(dict(point))

    def ask(self, count: int) -> list[Point]:
        """The next points to try, in numbers of few digits."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._trials = [self._study.ask(self._spread) for _ in range(count)]
        return [
            {key: self._short(key, value) for key, value in trial.params.items()} for trial in self._trials
        ]

    def _short(self, key: str, value: float | int) -> float | int:
        """A number as people write it, within its bounds."""
        spread = self._spread[key]
        return (
            value
            if isinstance(value, int)
            else min(max(float(f"{value:.{DIGITS}g}"), spread.low), spread.high)
        )

    def tell(self, answers: Sequence[PointResult]) -> None:
        """Answer the points that were asked for last."""
        fail = self._optuna.trial.TrialState.FAIL
        for trial, (values, violations) in zip(self._trials, answers, strict=True):
            if values is None or not all(map(math.isfinite, values)):
                self._study.tell(trial, state=fail)
                continue
            for name, excess in violations.items():
                trial.set_constraint(name, excess)
            self._study.tell(trial, list(values))
