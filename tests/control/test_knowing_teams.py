"""Teams whose robots know only what they see and hear: the NumPy form beside the kernel, and by hand."""

import pytest

from tests.control.test_teams import walk

SIGHT = {
    "robots": [1, 2, 3, 4, 7, 9], "range": 12.0, "noise": {"position": 0.05, "velocity": 0.05},
    "dropout": 0.2, "outliers": {"share": 0.1, "size": 1.0},
}  # fmt: skip
RADIO = {"rate": 5, "delay": [0.1, 0.4], "loss": 0.2, "range": 20.0, "timeout": 1.5}
INITIAL = {"position": 0.5, "velocity": 0.1, "acceleration": 0.05}
LOSSES = [{"robot": 4, "at": 1.0}, {"robot": 9, "at": 5.0}]


def known(estimator: object = "covariance_intersection", **sight: object) -> dict[str, object]:
    return {"knowledge": {"target": SIGHT | sight, "estimator": estimator, "initial": INITIAL}}


@pytest.mark.crossed
@pytest.mark.parametrize("failures", [[], LOSSES])
@pytest.mark.parametrize(("axes", "spread"), [
    (2, "vertices"), (2, "repulsion"), (2, "spacing"), (2, "orbit"), (2, "connect"), (3, "vertices"),
    (3, "repulsion"),
])  # fmt: skip
def test_kernel_and_twin_agree(axes: int, spread: object, failures: list[object]) -> None:
    walk(axes, spread, failures=failures, communication=RADIO, **known())


@pytest.mark.crossed
@pytest.mark.parametrize("estimator", [
    "hold", "predict", {"estimator": "kalman", "model": "acceleration"}, "consensus",
])  # fmt: skip
def test_with_every_estimator(estimator: object) -> None:
    """All robots see, and covariances depend on places: of two equal ones, rounding would choose.

    For five seconds: what rounding leaves grows threefold in each further one.
    """
    sight = {"robots": None, "range": None, "dropout": 0.0, "measures": ["position", "velocity", "range"]}
    sight["noise"] = {"position": 0.05, "velocity": 0.05, "range": 0.05}
    walk(2, "vertices", steps=50, communication=RADIO | {"neighbors": 4}, **known(estimator, **sight))


@pytest.mark.crossed
@pytest.mark.parametrize(("axes", "measures"), [(2, "range"), (3, "bearing")])
def test_with_ranges_and_bearings(axes: int, measures: str) -> None:
    sight = {"measures": [measures], "noise": {measures: 0.05}, "outliers": None}
    walk(axes, "vertices", communication=RADIO, **known("kalman", **sight))


def test_what_hides_a_target_is_not_the_target() -> None:
    walk(
        2, "vertices", communication=RADIO | {"blocked": True}, **known(hidden=True, hidden_by_teammates=True)
    )


def test_without_a_radio_and_with_a_radio_alone() -> None:
    walk(2, "vertices", **known())
    walk(2, "vertices", communication=RADIO)


@pytest.mark.slow_cases("barrier_filter", "potential_field")
@pytest.mark.crossed
@pytest.mark.parametrize("failures", [[], LOSSES])
@pytest.mark.parametrize(("axes", "outer"), [
    (2, "set_based"), (3, "set_based"), (2, {"loop": "set_based", "patience": 0.5, "turn_back": 1.0}),
    (2, "barrier_filter"), (2, "potential_field"),
])  # fmt: skip
@pytest.mark.parametrize("heard", [False, True])
def test_with_other_outer_loops(axes: int, outer: object, failures: list[object], heard: bool) -> None:
    avoid = {"behavior": "avoid_obstacles", "safe_distance": 0.3}
    walk(
        axes, "vertices", 1e-8, avoid | {"teammates": "heard"} if heard else avoid, outer=outer,
        failures=failures, communication=RADIO, **known(),
    )  # fmt: skip
