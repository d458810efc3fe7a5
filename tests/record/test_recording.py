"""A recording reads as the trace that is made of it: the same metrics and verdicts, window by window."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import escort_mj
from escort_mj.expect.verdicts import judge
from escort_mj.measuring import measures_of
from escort_mj.metrics import METRICS
from escort_mj.mission import Flight, fly
from escort_mj.record.recording import record as recording_of
from escort_mj.record.window import window
from tests.synthetic import build_trace

Samples = Callable[..., Any]
MISSIONS = {
    "collision": ("faults/collision", ()),
    "one of six fails": ("one_of_six_fails", ("duration=3", "robots.failures[0].at=1", "expect=[]")),
    "truth": ("truth", ("duration=2", "expect=[]")),
}


@pytest.fixture(scope="module", params=MISSIONS)
def flown(request: pytest.FixtureRequest) -> Flight:
    """Missions that together have every kind of signal: touches, losses, the truth."""
    name, overrides = MISSIONS[request.param]
    return fly(escort_mj.load_scenario(name, overrides))


@pytest.mark.slow_cases("one of six")
def test_metrics_and_verdicts_are_those_of_the_trace(flown: Flight) -> None:
    assert measures_of(flown.recording) == measures_of(flown.trace)
    assert flown.verdicts == judge(flown.scenario.expect, flown.trace, flown.outcome)


@pytest.mark.slow_cases("truth", "collision")
def test_so_is_every_metric_of_a_window(flown: Flight) -> None:
    end = float(flown.trace.time[-1])
    for after, before in ((0.3 * end, 0.7 * end), (0.5 * end, None), (0.0, 0.4 * end)):
        part, expected = (window(one, after, before) for one in (flown.recording, flown.trace))
        assert part.sizes["time"] == expected.sizes["time"] > 1
        for metric in METRICS:
            assert metric.of(part) == metric.of(expected), metric.name


def test_its_parts_are_those_of_the_trace(flown: Flight) -> None:
    some = np.arange(flown.recording.sizes["time"]) % 7 == 0
    part, expected = (one.isel(time=some) for one in (flown.recording, flown.trace))
    assert dict(part.sizes) == dict(expected.sizes)
    for name, variable in expected.variables.items():
        np.testing.assert_array_equal(part[name].values, variable.values)


def test_windows_share_memory(record: Samples) -> None:
    """A window of a mission costs nothing however long the mission is."""
    made = recording_of(*record(50))
    part = window(made, 0.1, 0.5)
    assert np.shares_memory(part["q"].values, made["q"].values) and part.sizes["time"] < 50
    assert window(made, 1e3).sizes["time"] == 0


def test_the_dataset_is_the_trace(record: Samples) -> None:
    samples, sizes, labels = record(20)
    assert recording_of(samples, sizes, labels).to_dataset().identical(build_trace(samples, sizes, labels))
