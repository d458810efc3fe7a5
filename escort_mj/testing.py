"""Assertions on runs, for tests in Python: each is an expectation as scenarios have it, judged on the spot.

from escort_mj.testing import assert_no_contacts, assert_settled

def test_the_team_gathers(escort_run):
    run = escort_run("main", {"robots.mass": 2})
    assert_no_contacts(run, between=("robots", "obstacles"))
    assert_settled(run, within=0.05, by=55)
"""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from escort_mj.errors import Fault, ScenarioError
from escort_mj.expect.verdicts import Verdict, judge_one
from escort_mj.runs import Run
from escort_mj.scenario import Scenario
from escort_mj.scenario.checks.expectations import check_bounds, check_sides, check_windows
from escort_mj.scenario.findings import key_path
from escort_mj.scenario.reader import explain

Sides = tuple[str, str]


class VerdictError(AssertionError):
    """What was expected of a run did not hold.

    Attributes:
        run: The run.
        verdicts: Those that failed.
    """

    def __init__(self, run: Run, *verdicts: Verdict) -> None:
        self.run = run
        self.verdicts = verdicts
        super().__init__("\n".join(verdict.message for verdict in verdicts))


def assert_passed(run: Run) -> None:
    """Every verdict of a run holds, that of its outcome among them.

    Raises:
        VerdictError: With those that do not.
    """
    __tracebackhide__ = True
    if failed := [verdict for verdict in run.verdicts if not verdict.passed]:
        raise VerdictError(run, *failed)


def assert_no_contacts(
    run: Run, between: Sides | None = None, after: float = 0.0, before: float | None = None
) -> None:
    """Nothing touches anything else, but for the floor.

    Args:
        run: A run, or a run folder that was opened.
        between: Two groups (robots, target, obstacles, walls, floor) or bodies by name; None for any two.
        after: Start of the window [s].
        before: Its end [s]; None for the end of the run.

    Raises:
        VerdictError: If they touch.
        ScenarioError: If the run's scenario has no such group or body.
    """
    __tracebackhide__ = True
    assert_expected(run, contacts="none" if between is None else between, after=after, before=before)


def assert_clearance(
    run: Run, between: Sides, at_least: float, after: float = 0.0, before: float | None = None
) -> None:
    """Two groups or bodies stay apart, surface to surface, at every physics step.

    Args:
        run: A run, or a run folder that was opened.
        between: Two groups or bodies; a body that is neither robot nor target has to be named by a clearance
            in the scenario's own expectations, so that the run records it.
        at_least: [m].
        after: Start of the window [s].
        before: Its end [s]; None for the end of the run.

    Raises:
        VerdictError: If they come nearer.
        ScenarioError: If the run's scenario has no such group or body.
    """
    __tracebackhide__ = True
    assert_expected(run, clearance=between, at_least=at_least, after=after, before=before)


def assert_settled(run: Run, within: float, by: float, before: float | None = None) -> None:
    """Every robot is at the mission's radius by some time, and stays.

    Args:
        run: A run, or a run folder that was opened.
        within: How far from it a robot may be [m].
        by: From when on [s].
        before: Until when [s]; None for the end of the run.

    Raises:
        VerdictError: If one is farther.
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
) -> None:
    """A metric is within bounds.

    Args:
        run: A run, or a run folder that was opened.
        metric: Its name.
        at_most: Upper bound, in its unit.
        at_least: Lower bound, in its unit.
        after: Start of the window [s].
        before: Its end [s]; None for the end of the run.

    Raises:
        VerdictError: If it is not.
        ScenarioError: If there is no such metric, or no value can be in bounds.
    """
    __tracebackhide__ = True
    assert_expected(run, metric=metric, at_most=at_most, at_least=at_least, after=after, before=before)


def assert_sane(run: Run, *checks: str) -> None:
    """The simulation can be trusted.

    Args:
        run: A run, or a run folder that was opened.
        checks: Some of warnings, finite, energy, tunneling; all of them if none is named.

    Raises:
        VerdictError: If it cannot.
    """
    __tracebackhide__ = True
    assert_expected(run, sanity=checks or "all")


def assert_expected(run: Run, **expectation: Any) -> Verdict:
    """Any expectation, with the keys that it has in a scenario.

    Args:
        run: A run, or a run folder that was opened.
        expectation: Such as `contacts=("robots", "walls"), peak_force=5.0`.

    Returns:
        The verdict.

    Raises:
        VerdictError: If it does not hold.
        ScenarioError: If it is not an expectation, or none of the run's scenario.
    """
    __tracebackhide__ = True
    verdict = judge_one(_with(run.scenario, expectation).expect[0], run.trace, run.outcome)
    if not verdict.passed:
        raise VerdictError(run, verdict)
    return verdict


def _with(scenario: Scenario, expectation: dict[str, Any]) -> Scenario:
    """The scenario with this expectation alone, checked.

    Raises:
        ScenarioError: If it is none, or none of this scenario.
    """
    data = scenario.model_dump() | {"expect": (expectation,)}
    try:
        changed = type(scenario).model_validate(data)
    except ValidationError as error:
        found = explain.findings_of(error, data, type(scenario))
    else:
        found = [
            finding for check in (check_bounds, check_windows, check_sides) for finding in check(changed)
        ]
        if not found:
            return changed
    faults = [Fault(f.message, key_path(f.path).removeprefix("expect[0]").removeprefix(".")) for f in found]
    raise ScenarioError(faults) from None
