"""What a metric is, shipped or a plugin's: a function of a trace that says its unit and its meaning."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from escort_mj.control.custom.place import place_of
from escort_mj.errors import NotLoggedError
from escort_mj.record.recording import sealed

if TYPE_CHECKING:
    from escort_mj.record.recording import Recorded

F = TypeVar("F", bound=Callable[..., Any])
_MARK = "__escort_mj_metric__"

Bodies = tuple[str, ...]


class Measure(NamedTuple):
    """The value of a metric.

    Attributes:
        value: In the metric's unit; None where the metric says nothing of this run, infinite for "never".
        time: Moment of the worst value [s]; None where there is none.
        bodies: Names of the bodies that had it; empty where no body in particular.
        reason: Why there is no value.
        broken: Whether that is an error of the metric's function.
    """

    value: float | None
    time: float | None = None
    bodies: Bodies = ()
    reason: str = ""
    broken: bool = False

    @property
    def who(self) -> str:
        """The bodies in words."""
        return in_words(self.bodies)


def in_words(bodies: Bodies) -> str:
    """Names of bodies in a sentence: `robots 1 and 2`, `robot 1 and gate`."""
    bodies = tuple(dict.fromkeys(bodies))  # the same one in two parts: once
    numbers = [name.removeprefix("robot_") for name in bodies]
    if len(bodies) > 1 and all(number.isdigit() for number in numbers):
        return f"robots {' and '.join(numbers)}"
    return " and ".join(name.replace("robot_", "robot ") for name in bodies)


class Metric(NamedTuple):
    """One number that sums up a run, or a window of it.

    Attributes:
        name: Key in metrics.json, and the name that an expectation uses.
        unit: SI unit, `1` for none.
        meaning: One sentence for the docs.
        function: What measures it: of a trace, a number, a `Measure`, or None.
        tail: Whether the run's own summary looks at its tail only (steady state) instead of all of it.
        least: No value is below this.
        most: No value is above this.
        grows: Whether it can only grow as its window does.
        watched: Whether it reads what is watched between samples.
        more_is_better: Whether larger values are the better ones.
        dear: Says of a trace whether measuring it takes long; None for a metric that is always quick.
        rank: Where tables list it, in ascending order; equal ones by name.
        of_team: Whether it is of robots around a target: in missions with several teams, of each by itself.
    """

    name: str
    unit: str
    meaning: str
    function: Callable[[Any], Any]
    tail: bool = False
    least: float = 0.0
    most: float = math.inf
    grows: bool = False
    watched: bool = True
    more_is_better: bool = False
    dear: Callable[[Any], bool] | None = None
    rank: float = math.inf
    of_team: bool = False

    def of(self, trace: Recorded) -> Measure:
        """Return its value over all of a trace; an error of its function gives no value but the reason."""
        try:
            found = self.function(sealed(trace))
            if isinstance(found, Measure):
                return found
            if found is None:
                return Measure(None, reason=f"{self.name} says nothing of this run")
            return Measure(float(found))
        except NotLoggedError as error:
            return Measure(None, reason=str(error))
        except Exception as error:
            return Measure(None, reason=place_of(error, self.function), broken=True)


def metric(
    *,
    unit: str,
    tail: bool = False,
    least: float = 0.0,
    most: float = math.inf,
    grows: bool = False,
    watched: bool = True,
    more_is_better: bool = False,
    dear: Callable[[Any], bool] | None = None,
    rank: float = math.inf,
    of_team: bool = False,
) -> Callable[[F], F]:
    """Make a function of a trace a metric: in metrics.json, and in expectations, by the function's name.

    The first paragraph of the function's text in triple quotes is its meaning. It gets the recorded signals
    within a window (`trace["q"].values`, `trace.attrs`, `trace.sizes`), and returns a number, a `Measure`
    that says when and who, or None where it says nothing of a run.

    Args:
        unit: SI unit, `1` for none.
        tail: Whether the run's own summary looks at its last fifth only (steady state).
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
    """

    def mark(function: F) -> F:
        meaning = _uncapitalized(" ".join((function.__doc__ or "").split("\n\n")[0].split()).rstrip("."))
        name = function.__name__
        made = Metric(
            name,
            unit,
            meaning,
            function,
            tail,
            least,
            most,
            grows,
            watched,
            more_is_better,
            dear,
            rank,
            of_team,
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


def metrics_in(package: str, path: Iterable[str]) -> tuple[Metric, ...]:
    """Return the metrics that the modules of a package define, by rank and name.

    Args:
        package: Its name.
        path: Its folders.
    """
    names = [f"{package}.{each.name}" for each in iter_modules(path)]
    found = [metric for name in names for metric in metrics_of(import_module(name), name)]
    return tuple(sorted(found, key=lambda metric: (metric.rank, metric.name)))
