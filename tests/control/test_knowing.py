"""What each robot knows: the compiled form against its NumPy twin, on random missions."""

from dataclasses import replace

import numpy as np
import pytest

from escort_mj.behaviors import AvoidObstacles, Vertices
from escort_mj.control.outer_loops import BarrierFilter, Nsb, PotentialField, SetBased
from escort_mj.control.setup import Setup
from escort_mj.control.trigger import Trigger
from escort_mj.estimators import ESTIMATORS, CovarianceIntersection, Kalman
from escort_mj.failures.motors import Dead
from escort_mj.knowledge.sight import MEASURES, Outliers, SightNoise, TargetSight
from escort_mj.radios import Periodic
from escort_mj.radios.radio import Blackout, Loss, Nearest
from escort_mj.sensing.sensors import Sensors
from escort_mj.sensors import Plain
from tests.control.twins import AVOID, REPULSION, SURFACE, VERTICES, compare, mission

CHAIN = Loss(mean=0.375, burst=2.0)  # a link fails with 0.3 and recovers with 0.5
RADIOS = {
    "every step": Periodic(timeout=None),
    "late and lossy": Periodic(rate=250.0, delay=(0.002, 0.01), jitter=0.002, loss=CHAIN, timeout=0.02),
    "three nearest": Periodic(
        graph=Nearest(nearest=3), delay=(0.0, 0.004), range=9.0, measure="surface", timeout=0.004
    ),
    "silence": Periodic(
        timeout=None, blackouts=(Blackout(after=0.004, before=0.01, groups=((1, 2, 3), (4, 5, 6))),)
    ),
}
BAD = SightNoise(position=0.05, velocity=0.1, range=0.02, bearing=0.01)
SIGHTS = {
    "everybody": TargetSight(noise=SightNoise(position=0.05, velocity=0.1)),
    "some, badly": TargetSight(
        robots=(1, 3, 6), rate=250.0, measures=MEASURES, noise=BAD, dropout=0.3,
        outliers=Outliers(share=0.3, size=2.0), range=6.0, hidden=True,
    ),
    "ranges": TargetSight(robots=(1, 3, 4, 6), measures=("range",), noise=SightNoise(range=0.05)),
    "bearings": TargetSight(measures=("bearing",), noise=SightNoise(bearing=0.02)),
}  # fmt: skip


def informed(axes: int, seed: int, **changes: object) -> tuple[Setup, np.ndarray, np.ndarray]:
    setup, q, v = mission(axes, seed)
    return replace(setup, **{"behaviors": (AVOID, VERTICES, SURFACE), **changes}), q, v  # type: ignore[arg-type]


MAKES = [*(kind() for kind in ESTIMATORS), Kalman(model="acceleration", noise=2.0)]


@pytest.mark.crossed
@pytest.mark.parametrize(("sight", "axes"), [("everybody", 2), ("some, badly", 3)])
@pytest.mark.parametrize("radio", RADIOS)
@pytest.mark.parametrize("estimator", MAKES, ids=str)
def test_every_estimator_and_radio(estimator, radio: str, sight: str, axes: int) -> None:
    setup, q, v = informed(
        axes,
        1,
        sight=SIGHTS[sight],
        radio=RADIOS[radio],
        estimator=estimator,
        start_deviation=(0.5, 0.2, 0.1),
    )
    compare(setup, q, v, steps=12)


@pytest.mark.crossed
@pytest.mark.parametrize(("sight", "axes"), [("ranges", 2), ("bearings", 3), ("ranges", 3), ("bearings", 2)])
@pytest.mark.parametrize("estimator", [CovarianceIntersection(), Kalman(model="acceleration")], ids=str)
def test_ranges_and_bearings(estimator, sight: str, axes: int) -> None:
    setup, q, v = informed(
        axes, 2, sight=SIGHTS[sight], radio=RADIOS["late and lossy"], estimator=estimator,
        start_deviation=(0.5, 0.2, 0.1), outer=SetBased(), behaviors=(AVOID, REPULSION, SURFACE),
        sensing=Sensors(
            Plain(noise=0.02, resolution=0.01), Plain(noise=0.01), Plain(noise=0.05), Plain(noise=0.03)
        ),
    )  # fmt: skip
    compare(setup, q, v, steps=12, tolerance=1e-8)


def test_without_a_radio() -> None:
    setup, q, v = informed(
        2, 3, sight=SIGHTS["everybody"], sensing=Sensors(Plain(noise=0.02), Plain(noise=0.01))
    )
    compare(setup, q, v, steps=6)


@pytest.mark.crossed
@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("radio", RADIOS)
def test_bids_for_vertices(radio: str, axes: int) -> None:
    setup, q, v = informed(
        axes, 4, sight=SIGHTS["everybody"], radio=RADIOS[radio], start_deviation=(0.5, 0.2, 0.1),
        behaviors=(AVOID, Vertices(assignment="auction"), SURFACE),
    )  # fmt: skip
    compare(setup, q, v, steps=20)


HEARD = AvoidObstacles(safe_distance=1.0, teammate_distance=3.0, teammates="heard")
BOUNDED = {"max_speed": 1.5, "force_limit": np.array([10.0, 50.0, 200.0, np.inf, 20.0, 1.0])}


@pytest.mark.crossed
@pytest.mark.parametrize("radio", ["late and lossy", "three nearest"])
@pytest.mark.parametrize(
    ("outer", "measure", "axes"),
    [
        (Nsb(), "surface", 2),
        (Nsb(), "center", 3),
        (SetBased(rate=3.0), "surface", 3),
        (SetBased(activation="tangent_cone"), "center", 2),
        (BarrierFilter(), "surface", 2),
        (PotentialField(), "center", 3),
    ],
    ids=lambda each: getattr(each, "loop", str(each)),
)
def test_teammates_avoided_by_what_they_have_sent(outer, measure: str, axes: int, radio: str) -> None:
    """Robots are 3 m from each other or nearer, and one of them has failed, which all see."""
    setup, q, v = informed(
        axes, 4, sight=SIGHTS["everybody"], radio=RADIOS[radio], outer=outer, **BOUNDED,
        behaviors=(HEARD.model_copy(update={"measure": measure}), REPULSION, SURFACE),
        failures=(Dead(robot=2, at=0.0, notice=0.009),),
    )  # fmt: skip
    active = compare(setup, 0.6 * q, v, steps=12, tolerance=1e-10 if outer.loop == "nsb" else 1e-8)
    assert active.any() and not active.all()


def test_the_event_trigger_notices_teammates_that_are_heard() -> None:
    setup, q, v = informed(
        2, 5, sight=SIGHTS["everybody"], radio=RADIOS["late and lossy"], behaviors=(HEARD, SURFACE),
        trigger=Trigger(dwell=0.004), **BOUNDED,
    )  # fmt: skip
    assert compare(setup, q, v, steps=12).any()
