"""What a metric is, shipped or a plugin's: a function of a trace that says its unit and its meaning."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from importlib import import_module
from inspect import isfunction
from pkgutil import iter_modules
from types import ModuleType
from typing import Any, Literal, NamedTuple, TypeVar, get_args

import numpy as np

from escort_mj.errors import NotLoggedError, PluginCallError, UsageError, visible
from escort_mj.metrics.measure import Bodies, Measure
from escort_mj.metrics.watching import Watch
from escort_mj.plugin_calls import calling, is_plugins
from escort_mj.record.recording import Recorded, is_log, lent, sealed
from escort_mj.record.window import OVERS, Over, Span, end_of, rate_of

F = TypeVar("F", bound=Callable[..., Any])
Need = Literal[
    "beliefs",
    "goals",
    "links",
    "max_speed",
    "messages",
    "opponents",
    "sliding_mode",
    "target",
    "tethers",
    "truth",
]
NEEDS = get_args(Need)
"""What of a mission metrics and expectations can be about."""
_MARK = "__escort_mj_metric__"
KINDS = ("mean", "max", "min", "rms", "share")  # last words of names that say of what kind a number is

DEAR = "takes long with so many robots and samples; measured where an expectation names it"
ROUNDING = 1e-9
"""Share of a bound by which a value may be beyond it."""


def number(value: Any, what: str, finite: bool = False) -> float:
    """Return a number that a plugin gave.

    Args:
        value: What it gave.
        what: What to call it in messages.
        finite: Whether it must not be infinite.

    Raises:
        TypeError: If it is no number.
        ValueError: If it is NaN, or infinite and must not be.
    """
    array = np.asarray(value)
    if array.ndim or array.dtype.kind not in "biuf" or np.any(getattr(value, "mask", False)):
        kind = f"an array of shape {array.shape}" if isinstance(value, np.ndarray) else type(value).__name__
        raise TypeError(f"{what}: found {kind}; expected a number")
    found = float(array)
    if math.isnan(found) or (finite and math.isinf(found)):
        raise ValueError(f"{what}: found {found:g}; expected a {'finite ' * finite}number")
    return found


def moment_in(value: Any, trace: Recorded) -> float:
    """Return a time of a run that a plugin gave [s].

    Raises:
        TypeError: If it is no number.
        ValueError: If it is none, or the run was not under way then.
    """
    found, end, rate = number(value, "time", finite=True), end_of(trace), rate_of(trace)
    if found < 0.0 or (rate is not None and found > end + 1.0 / rate):
        raise ValueError(f"time: found {found:g} s; expected a time of the run, from 0 to {end:g} s")
    return found


def text(value: Any, what: str) -> str:
    """Return a text that a plugin gave, without control characters.

    Raises:
        TypeError: If it is none.
    """
    if not isinstance(value, str):
        raise TypeError(f"{what}: found {type(value).__name__}; expected a text")
    return visible(value)


def flag(value: Any, what: str) -> bool:
    """Return whether a plugin said yes.

    Raises:
        TypeError: If it said neither yes nor no.
    """
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{what}: found {type(value).__name__}; expected True or False")
    return bool(value)


def names(value: Any, trace: Recorded) -> Bodies:
    """Return names of bodies of a trace that a plugin gave.

    Raises:
        TypeError: If they are none.
        ValueError: If there is no such body.
    """
    if not isinstance(value, list | tuple) or not all(isinstance(each, str) for each in value):
        kind = type(value).__name__
        raise TypeError(f'bodies: found {kind}; expected names of bodies, such as ("robot_1",)')
    if strange := set(value).difference(trace["body"].values.tolist() if "body" in trace else value):
        raise ValueError(f"bodies: found {min(strange)!r:.80}, which is no body of this run")
    return tuple(map(str, value))


class Metric(NamedTuple):
    """One number that sums up a run, or a window of it.

    Attributes:
        name: Key in metrics.json, and the name that an expectation uses.
        unit: SI unit, `1` for none.
        meaning: One sentence for the docs.
        function: What measures it: of a trace, a number, a `Measure`, or None.
        over: What the run's own summary looks at: the `whole` run, or its `tail` (steady state).
        least: No value is below this.
        most: No value is above this.
        grows: Whether it can only grow as its window does.
        watched: Whether it reads what is watched between samples.
        more_is_better: Whether larger values are the better ones.
        dear: Says of a trace whether measuring it takes long; None for a metric that is always quick.
        rank: Where tables list it, in ascending order; equal ones by name.
        of_team: Whether it is of robots around a target: in missions with several teams, of each by itself.
        every_step: Whether it counts every physics step; otherwise it is read at the samples.
        moment: Whether it is a moment of the run, which is looked for in all of it.
        watches: What an expectation of it asks about every physics step: then it counts these, too.
        leaves_out: Whether robots that have failed are no part of it, so that a verdict names them.
        needs: What a mission must have for it to have a value.
    """

    name: str
    unit: str
    meaning: str
    function: Callable[[Any], Any]
    over: Over = "whole"
    least: float = 0.0
    most: float = math.inf
    grows: bool = False
    watched: bool = True
    more_is_better: bool = False
    dear: Callable[[Any], bool] | None = None
    rank: float = math.inf
    of_team: bool = False
    every_step: bool = False
    moment: bool = False
    watches: tuple[Watch, ...] = ()
    leaves_out: bool = False
    needs: tuple[Need, ...] = ()

    @property
    def title(self) -> str:
        """Its name in words, as heads of tables have it: `radius error, mean`."""
        return title_of(self.name)

    @property
    def span(self) -> Span:
        """What the run's own summary looks at."""
        return Span(self.over)

    @property
    def read(self) -> str:
        """When it looks at a run: at every physics step, at the samples, or at steps where one asks."""
        return "every step" if self.every_step else "steps if expected" if self.watches else "samples"

    def sees_steps(self, trace: Recorded, team: str = "") -> bool:
        """Whether it saw every physics step of a trace.

        Args:
            trace: The whole trace.
            team: Name of the team that it is of; empty for all robots.
        """
        asked = {watch._replace(team=team).label for watch in self.watches}
        known = set(trace["watch"].values.tolist()) if "watch" in trace else set()
        return self.every_step or (bool(asked) and asked <= known)

    def of(self, trace: Recorded, unless_dear: bool = False) -> Measure:
        """Return its value over all of a trace; an error of its function gives no value but the reason.

        Args:
            trace: The trace.
            unless_dear: Whether it has no value where measuring it takes long.
        """
        try:
            if unless_dear and self.dear is not None:
                with calling(self.dear, is_log(trace)):
                    if flag(self.dear(lent(trace) if is_plugins(self.dear) else trace), "dear"):
                        return Measure(None, reason=DEAR)
            with calling(self.function, is_log(trace)):
                shown = lent(trace) if is_plugins(self.function) else sealed(trace)
                return self._checked(self.function(shown), trace)
        except NotLoggedError as error:
            return Measure(None, reason=str(error), unlogged=True)
        except PluginCallError as error:
            return Measure(None, reason=str(error), broken=True)

    def _checked(self, found: Any, trace: Recorded) -> Measure:
        """What its function returned as a measure of a trace.

        Raises:
            TypeError: If it is of another kind.
            ValueError: If it is a number that the metric cannot have.
        """
        if found is None:
            return Measure(None, reason=f"{self.name} says nothing of this run")
        if not is_plugins(self.function):  # tests hold those that ship to what they declare
            return found if isinstance(found, Measure) else Measure(float(found))
        if not isinstance(found, Measure):
            found = Measure(number(found, "the metric"))
        found = Measure(
            None if found.value is None else number(found.value, "value"),
            None if found.time is None else moment_in(found.time, trace),
            names(found.bodies, trace),
            text(found.reason, "reason") or ("" if found.value is not None else f"{self.name} has no value"),
            bool(found.broken),
            manner=text(found.manner, "manner"),
        )
        if found.value is not None and not self._allows(found.value):
            limits = f"at least {self.least:g}" + (
                f" and at most {self.most:g}" if self.most < math.inf else ""
            )
            words = "@metric(least=..., most=...) declares others"
            raise ValueError(f"found {found.value:g}; by its own bounds, {self.name} is {limits}; {words}")
        return found

    def _allows(self, value: float) -> bool:
        """Whether a value is within the bounds, but for rounding."""
        low, high = (ROUNDING * abs(one) if math.isfinite(one) else 0.0 for one in (self.least, self.most))
        return self.least - max(low, ROUNDING) <= value <= self.most + max(high, ROUNDING)


def title_of(name: str) -> str:
    """Return a metric's name in words: `radius error, mean`."""
    words, _, kind = name.replace("_", " ").rpartition(" ")
    return f"{words}, {kind}" if words and kind in KINDS else name.replace("_", " ")


def metric(
    *,
    unit: str,
    over: Over = "whole",
    least: float = 0.0,
    most: float = math.inf,
    grows: bool = False,
    watched: bool = True,
    more_is_better: bool = False,
    dear: Callable[[Any], bool] | None = None,
    rank: float = math.inf,
    of_team: bool = False,
    every_step: bool = False,
    moment: bool = False,
    watches: tuple[Watch, ...] = (),
    leaves_out: bool | None = None,
    needs: tuple[Need, ...] = (),
    tail: object = None,
) -> Callable[[F], F]:
    """Make a function of a trace a metric: in metrics.json, and in expectations, by the function's name.

    The first paragraph of the function's text in triple quotes is its meaning. It gets the recorded signals
    within a window (`trace["q"].values`, `trace.attrs`, `trace.sizes`), and returns a number, a `Measure`
    that says when and who, or None where it says nothing of a run.

    Args:
        unit: SI unit, `1` for none.
        over: What the run's own summary looks at: the `whole` run, or its `tail`, which is its last fifth
            (steady state).
        least: No value is below this.
        most: No value is above this.
        grows: Whether it can only grow as its window does, as a largest value does.
        watched: Whether it reads what is watched between samples, such as clearances and largest speeds; if
            so, an expectation of it has a sample in the step before its window.
        more_is_better: Whether larger values are the better ones, in tables of studies.
        dear: Says of a trace whether measuring it takes long. If so, a run's own summary has the metric only
            where an expectation of the scenario names it.
        rank: Where tables list it, in ascending order; equal ones by name, those without one at the end.
        of_team: Whether it is of robots around a target: in missions with several teams, of each by itself.
        every_step: Whether it counts every physics step, as what reads running totals, the contact log or
            what is watched between samples does; otherwise it is read at the samples.
        moment: Whether it is a moment of the run, which is looked for in all of it.
        watches: What an expectation of it asks about every physics step: then it counts these, too.
        leaves_out: Whether robots that have failed are no part of it, so that a verdict names them; None: as
            `of_team`.
        needs: What a mission must have for it to have a value, such as `("goals",)`: where a scenario lacks
            it, an expectation of the metric is an error.
        tail: Of earlier versions; `over` says it now.

    Raises:
        UsageError: If an argument is of another kind, or `tail` is given.
    """
    if tail is not None:
        raise UsageError(
            '@metric(tail=...): write over="tail" for the last fifth of the run, or over="whole"'
        )
    if over not in OVERS:
        raise UsageError(f"@metric(over={over!r}): allowed are {' and '.join(map(repr, OVERS))}")
    for name, bound in {"least": least, "most": most, "rank": rank}.items():
        if not isinstance(bound, int | float) or math.isnan(bound):
            raise UsageError(f"@metric({name}={bound!r}): expected a number")
    flags = {"grows": grows, "watched": watched, "more_is_better": more_is_better, "of_team": of_team}
    for name, flag in (flags | {"every_step": every_step, "moment": moment}).items():
        if not isinstance(flag, bool):
            raise UsageError(f"@metric({name}={flag!r}): expected True or False")
    if dear is not None and not callable(dear):
        raise UsageError(f"@metric(dear={dear!r}): expected a function of a trace")
    if not isinstance(needs, tuple) or any(need not in NEEDS for need in needs):
        raise UsageError(f"@metric(needs={needs!r}): expected a tuple of some of {', '.join(NEEDS)}")
    if not isinstance(unit, str) or not unit:
        raise UsageError(f'@metric(unit={unit!r}): expected a unit, such as "m", or "1" for none')
    if least > most:
        raise UsageError(f"@metric(least={least:g}, most={most:g}): expected at least as much as least")

    def mark(function: F) -> F:
        if not isfunction(function):  # it is told by its file and line
            raise UsageError(f"@metric: found {type(function).__name__}; expected a function of a trace")
        meaning = _uncapitalized(" ".join((function.__doc__ or "").split("\n\n")[0].split()).rstrip("."))
        name = function.__name__
        made = Metric(
            name,
            unit,
            meaning,
            function,
            over,
            least,
            most,
            grows,
            watched,
            more_is_better,
            dear,
            rank,
            of_team,
            every_step,
            moment,
            watches,
            of_team if leaves_out is None else leaves_out,
            needs,
        )
        setattr(function, _MARK, made)
        return function

    return mark


def _uncapitalized(sentence: str) -> str:
    """The sentence as a table's cells have it; a first word such as `MuJoCo` or `V1` stays as it is."""
    rest = sentence.partition(" ")[0][1:]
    plain = rest == rest.lower() and not any(map(str.isdigit, rest))
    return sentence[:1].lower() + sentence[1:] if plain else sentence


def metric_of(function: Any) -> Metric | None:
    """The metric that a function was made; None for anything else."""
    found = getattr(function, _MARK, None) if callable(function) else None
    return found if isinstance(found, Metric) else None


def metrics_of(module: ModuleType, home: str) -> list[Metric]:
    """Return the metrics that a module brings, in the order in which they are written.

    Args:
        module: Where to look.
        home: Its name, or that of its package: what comes from elsewhere is not its own.
    """
    found = [(function, metric_of(function)) for function in vars(module).values()]
    return [
        metric
        for function, metric in found
        if metric is not None and (function.__module__ == home or function.__module__.startswith(f"{home}."))
    ]


def by_rank(metrics: Iterable[Metric]) -> tuple[Metric, ...]:
    """Return metrics as tables list them."""
    return tuple(sorted(metrics, key=lambda metric: (metric.rank, metric.name)))


def metrics_in(package: str, path: Iterable[str]) -> tuple[Metric, ...]:
    """Return the metrics that the modules of a package define, by rank and name.

    Args:
        package: Its name.
        path: Its folders.
    """
    names = [f"{package}.{each.name}" for each in iter_modules(path)]
    found = [metric for name in names for metric in metrics_of(import_module(name), name)]
    return by_rank(found)
