"""Missions side by side have the bits that they have alone, and what goes wrong with one stays with it."""

import hashlib
import threading
import time
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
import pytest

import escort_mj
from escort_mj import Run
from escort_mj.errors import ScenarioError, UsageError
from escort_mj.mission.batch import in_threads
from escort_mj.world.plant import Plant
from tests.corpus import missions

SHORT = ["duration=2", "expect=[]"]
MISSIONS = missions(__file__)


def digest(run: Run) -> str:
    """Of every bit that was recorded."""
    found = hashlib.sha256()
    for name in sorted(map(str, run.trace.variables)):
        values = run.trace[name].values
        found.update(values.tobytes() if values.dtype.kind != "U" else str(values.tolist()).encode())
    return found.hexdigest()


def told(run: Run) -> Any:
    """Everything else, but for the time that it took."""
    summary = {key: value for key, value in run.metrics.items() if key != "run"}
    return run.outcome, run.message, str(run.values), summary, run.verdicts


@pytest.fixture(scope="module")
def scenarios(compiled: None) -> list[escort_mj.Scenario]:
    return [
        escort_mj.load_scenario(one["of"], ([] if "whole" in one else SHORT) + one.get("set", []))
        for one in MISSIONS.values()
    ]


@pytest.fixture(scope="module")
def alone(scenarios: list[escort_mj.Scenario]) -> list[Run]:
    """Each mission by itself."""
    return [escort_mj.run(scenario) for scenario in scenarios]


@pytest.mark.parametrize("threads", [*(pytest.param(few, marks=pytest.mark.slow) for few in (1, 2)), 3])
def test_the_bits_are_those_of_single_runs(
    scenarios: list[escort_mj.Scenario], alone: list[Run], threads: int
) -> None:
    beside = list(escort_mj.run_many(scenarios, threads, traces=True))
    for name, one, other in zip(MISSIONS, alone, beside, strict=True):
        assert digest(one) == digest(other), name
        assert told(one) == told(other), name


def test_the_missions_end_as_differently_as_they_were_meant_to(alone: list[Run]) -> None:
    """Otherwise the test above would say little."""
    ends = dict(zip(MISSIONS, (run.outcome.value for run in alone), strict=True))
    assert ends.pop("diverges") == "diverged"
    assert ends.pop("unstable") == "unstable"
    assert set(ends.values()) == {"completed"}
    assert alone[list(MISSIONS).index("touches")].trace.sizes["episode"]
    assert len({digest(run) for run in alone}) == len(MISSIONS)


@pytest.mark.parametrize("threads", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_summaries_need_no_trace(scenarios: list[escort_mj.Scenario], alone: list[Run], threads: int) -> None:
    """Threads use their memory for samples again and again: nothing of one mission is left in the next."""
    for one, other in zip(alone, escort_mj.run_many(scenarios, threads), strict=True):
        assert told(one) == told(other)
        with pytest.raises(UsageError, match="not kept"):
            _ = other.trace


@pytest.mark.parametrize("threads", [1, 2])
def test_an_error_is_the_outcome_of_one_mission(
    scenarios: list[escort_mj.Scenario], alone: list[Run], threads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    victim = scenarios[1]
    start = Plant.__init__

    def breaks(plant: Plant, world: Any) -> None:
        start(plant, world)
        if world.setup.seed == victim.seed:
            raise mujoco.FatalError("stack overflow")

    monkeypatch.setattr(Plant, "__init__", breaks)
    runs = list(escort_mj.run_many(scenarios[:4], threads))
    assert (runs[1].outcome.value, runs[1].message) == ("failed", "FatalError: stack overflow")
    assert not runs[1].passed and runs[1].metrics == {}
    for place in (0, 2, 3):
        assert told(runs[place]) == told(alone[place])


def test_scenarios_are_taken_as_they_are_needed() -> None:
    """A few thousand scenarios need not be there at once, and results do not pile up."""
    taken = 0

    def many() -> Iterator[str]:
        nonlocal taken
        for seed in range(50):
            taken += 1
            yield escort_mj.load_scenario("main", ["duration=0.1", "expect=[]", f"seed={seed}"])

    reports: list[tuple[float, float]] = []
    runs = escort_mj.run_many(many(), 2, progress=lambda done, total: reports.append((done, total)))
    first = next(runs)
    assert taken <= 8 and first.scenario.seed == 0
    assert next(runs).scenario.seed == 1
    runs.close()
    assert taken <= 8 and reports == [(1, np.inf), (2, np.inf)]


def test_what_nobody_waits_for_stops(scenarios: list[escort_mj.Scenario]) -> None:
    """Two missions of an hour behind a short one: taking the first result and leaving ends them."""
    long = escort_mj.load_scenario("main", ["duration=20000", "recording.rate=10", "expect=[]"])
    before = threading.active_count()
    runs = escort_mj.run_many([scenarios[0], long, long], 2)
    assert next(runs).outcome.value == "completed"
    begun = time.monotonic()
    runs.close()
    assert time.monotonic() - begun < 60.0
    assert threading.active_count() == before
    assert mujoco.get_mjcb_control() is None


def test_results_come_in_order() -> None:
    """However long each takes."""
    naps = [0.05, 0.0, 0.02, 0.0, 0.04, 0.0]

    def nap(place: int) -> int:
        time.sleep(naps[place])
        return place

    assert list(in_threads(nap, range(6), 3)) == list(range(6))


def test_wrong_requests_are_refused() -> None:
    with pytest.raises(UsageError, match="threads: found 0; expected a whole number of at least 1"):
        escort_mj.run_many([], 0)
    with pytest.raises(ScenarioError):
        list(escort_mj.run_many([escort_mj.load_scenario("main", ["robots.mass=-1"])]))
    assert list(escort_mj.run_many([])) == []
