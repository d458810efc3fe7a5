"""The compiled supervisor and event trigger against their NumPy twins."""

from dataclasses import replace

import numpy as np
import pytest

from escort_mj.behaviors import Surface
from escort_mj.control.outer_loops import BarrierFilter, Nsb, OuterLoop, SetBased
from escort_mj.control.trigger import Trigger
from escort_mj.rules.quantities import ObstacleDistance, RobotDistance, TargetDistance, TargetObstacleDistance
from escort_mj.scenario.schema.scenario import Phase
from tests.control.twins import (
    AVOID,
    CHORDS,
    REPULSION,
    SURFACE,
    TOLERANCE,
    VERTICES,
    Kernel,
    assert_same,
    mission,
)
from tests.oracle.reference import ReferenceController

TRIGGER = Trigger(distance=0.2, share=0.05, dwell=0.004, longest=0.01)
PHASES = (
    Phase(behaviors=(SURFACE, AVOID), after=0.004, before=0.012),
    Phase(behaviors=(AVOID, SURFACE), when=ObstacleDistance(below=1.5, release=2.0)),
    Phase(behaviors=(Surface(gain=2.0), VERTICES), when=RobotDistance(below=2.5)),
    Phase(behaviors=(REPULSION,), when=TargetDistance(above=7.0, release=6.5)),
    Phase(
        behaviors=(AVOID, CHORDS, SURFACE), after=0.008, when=TargetObstacleDistance(below=2.5, scope="team")
    ),
    Phase(behaviors=(AVOID, SURFACE), after=0.014, when=RobotDistance(below=0.6, scope="team")),
)


@pytest.mark.slow_cases("set_based-3")
@pytest.mark.crossed
@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize(
    ("trigger", "outer"),
    [(None, Nsb()), *((TRIGGER, outer) for outer in (Nsb(), BarrierFilter(), SetBased()))],
    ids=["no trigger", "nsb", "barrier_filter", "set_based"],
)
def test_every_phase_and_the_trigger(trigger: Trigger | None, outer: OuterLoop, axes: int) -> None:
    seen: set[float] = set()
    for seed in range(4):
        setup, q, v = mission(axes, seed=20 + seed)
        setup = replace(setup, phases=PHASES, trigger=trigger, outer=outer)
        rng = np.random.default_rng(seed)
        kernel, twin = Kernel(setup), ReferenceController(setup, stride=1)
        twin.reset(q)
        for count in range(12):
            t = count * setup.timestep
            for _ in range(2):
                signals = twin.evaluate(t, q, v)
                assert_same(kernel.evaluate(t, q, v), signals, TOLERANCE)
            seen |= set(signals.phase)
            q, v = q + rng.normal(scale=0.3, size=q.shape), v + rng.normal(scale=0.5, size=v.shape)
        if trigger is not None:
            assert 1 < signals.outer_updates.min() < signals.outer_updates.max() <= 12
    assert seen >= {0.0, 1.0, 2.0, 3.0, 4.0, 5.0}
