"""Assertions on runs, for tests in Python. Each assertion evaluates an expectation of a scenario.

from escort_mj.testing import assert_no_contacts, assert_settled

def test_the_team_gathers(escort_run):
    run = escort_run("main", {"robots.mass": 2})
    assert_no_contacts(run, between=("robots", "obstacles"))
    assert_settled(run, within=0.05, by=55)
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import ValidationError

from escort_mj.api.runs import Run
from escort_mj.errors import Fault, ScenarioError
from escort_mj.expect.verdicts import judge_one
from escort_mj.record.outcome import Verdict
from escort_mj.scenario import Scenario
from escort_mj.scenario.arguments import checked
from escort_mj.scenario.checks.expectations import check_bounds, check_sides, check_windows
from escort_mj.scenario.findings import key_path
from escort_mj.scenario.mission import Mission
from escort_mj.scenario.reader import explain

Sides = tuple[str, str]


class VerdictError(AssertionError):
    """An expectation of a run failed.

    Attributes:
        run: The run.
        verdicts: The failed verdicts.
    """

    def __init__(self, run: Run, *verdicts: Verdict) -> None:
        self.run = run
        self.verdicts = verdicts
        super().__init__("\n".join(verdict.message for verdict in verdicts))


@checked
def assert_passed(run: Run) -> None:
    """Assert that every verdict of a run passes, including its outcome.

    Raises:
        VerdictError: With the failed verdicts.
    """
    __tracebackhide__ = True
    if failed := [verdict for verdict in run.verdicts if not verdict.passed]:
        raise VerdictError(run, *failed)


def assert_no_contacts(
    run: Run, between: Sides | None = None, after: float = 0.0, before: float | None = None
) -> None:
    """Assert that no bodies touch, except with the floor.

    Args:
        run: A run, or the result of `open_run`.
        between: Two groups (robots, target, obstacles, walls, floor) or bodies by name; None for any two.
        after: Start of the window [s].
        before: End of the window [s]; None for the end of the run.

    Raises:
        VerdictError: If bodies touch.
        ScenarioError: If the run's scenario does not have such a group or body.
    """
    __tracebackhide__ = True
    assert_expected(run, contacts="none" if between is None else between, after=after, before=before)


def assert_clearance(
    run: Run, between: Sides, at_least: float, after: float = 0.0, before: float | None = None
) -> None:
    """Assert that two groups or bodies stay apart, surface to surface, at every physics step.

    Args:
        run: A run, or the result of `open_run`.
        between: Two groups or bodies. If you name a body other than a robot or the target, a clearance
            expectation of the scenario must name it too, so that the run records it.
        at_least: Minimum distance [m].
        after: Start of the window [s].
        before: End of the window [s]; None for the end of the run.

    Raises:
        VerdictError: If they come closer.
        ScenarioError: If the run's scenario does not have such a group or body.
    """
    __tracebackhide__ = True
    assert_expected(run, clearance=between, at_least=at_least, after=after, before=before)


def assert_settled(run: Run, within: float, by: float, before: float | None = None) -> None:
    """Assert that every robot reaches the mission's radius by some time and stays there.

    Args:
        run: A run, or the result of `open_run`.
        within: Largest deviation from the radius [m].
        by: Latest settling time [s].
        before: End of the window [s]; None for the end of the run.

    Raises:
        VerdictError: If a robot deviates more.
    """
    __tracebackhide__ = True
    assert_expected(run, settled=within, by=by, before=before)


def assert_metric(
    run: Run,
    metric: str,
    at_most: float | None = None,
    at_least: float | None = None,
    after: float = 0.0,
    before: float | None = None,
    over: Literal["whole", "tail"] | None = None,
) -> None:
    """Assert that a metric is within bounds.

    Args:
        run: A run, or the result of `open_run`.
        metric: Name of the metric.
        at_most: Upper bound, in the unit of the metric.
        at_least: Lower bound, in the unit of the metric.
        after: Start of the window [s].
        before: End of the window [s]; None for the end of the run.
        over: Part of the run instead: the `whole` run, or its `tail`, which is its last fifth.

    Raises:
        VerdictError: If the metric is out of bounds.
        ScenarioError: If the metric does not exist, or if no value can meet the bounds.
    """
    __tracebackhide__ = True
    window = {"after": after, "before": before, "over": over}
    assert_expected(run, metric=metric, at_most=at_most, at_least=at_least, **window)


def assert_sane(run: Run, *checks: str) -> None:
    """Assert that the simulation is trustworthy.

    Args:
        run: A run, or the result of `open_run`.
        checks: Any of warnings, finite, energy, tunneling; by default all of them.

    Raises:
        VerdictError: If a check fails.
    """
    __tracebackhide__ = True
    assert_expected(run, sanity=checks or "all")


@checked
def assert_expected(run: Run, **expectation: Any) -> Verdict:
    """Assert any expectation, with the same keys as in a scenario.

    Args:
        run: A run, or the result of `open_run`.
        expectation: Keys, such as `contacts=("robots", "walls"), peak_force=5.0`.

    Returns:
        The verdict.

    Raises:
        VerdictError: If the expectation fails.
        ScenarioError: If the expectation is invalid or does not fit the run's scenario.
    """
    __tracebackhide__ = True
    verdict = judge_one(_with(run.scenario, expectation).expect[0], run.trace, run.outcome)
    if not verdict.passed:
        raise VerdictError(run, verdict)
    return verdict


def _with(scenario: Scenario, expectation: dict[str, Any]) -> Scenario:
    """Return the validated scenario with this expectation only.

    Raises:
        ScenarioError: If the expectation is invalid or does not fit this scenario.
    """
    data = scenario.model_dump() | {"expect": (expectation,)}
    try:
        changed = type(scenario).model_validate(data)
    except ValidationError as error:
        found = explain.findings_of(error, data, type(scenario))
    else:
        mission = Mission(changed)
        found = [one for check in (check_bounds, check_windows, check_sides) for one in check(mission)]
        if not found:
            return changed
    faults = [Fault(f.message, key_path(f.path).removeprefix("expect[0]").removeprefix(".")) for f in found]
    raise ScenarioError(faults) from None
