"""Packs what the controller is told into the flat vector of numbers that `plan.unpack_plan` reads."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.behaviors import AvoidObstacles, BehaviorParameters
from escort_mj.control.failure import FAILURE_SIZE, NEVER
from escort_mj.control.laws import ComputedTorque
from escort_mj.control.laws.sliding import SMOOTHINGS, SlidingModeLaw
from escort_mj.control.nsb import UNLIMITED
from escort_mj.control.outer_loops import BarrierFilter, PotentialField
from escort_mj.control.plan import (
    AVOID_OBSTACLES,
    KINDS,
    LAW,
    LAW_KINDS,
    LOOP_KINDS,
    MAGIC,
    OUTER,
    OUTER_DISTANCE,
    SCALARS,
    TRUTH,
)
from escort_mj.control.setup import Setup
from escort_mj.control.supervisor import Phase

Array = NDArray[np.float64]


def pack(setup: Setup, stride: int, coordinates: int, truth: bool = False) -> Array:
    """Packs a setup into the flat vector that `unpack_plan` reads.

    Args:
        setup: What the controller is told.
        stride: Physics steps between two samples.
        coordinates: Number of MuJoCo's generalized positions, for the record.
        truth: Whether to record the truth channel.
    """
    n, p, m = setup.count, setup.axes, len(setup.obstacle_radius)
    code, target_span, pieces = setup.target.programs()
    disturbance_span = np.zeros((p, 2))
    if setup.disturbance is not None:
        more_code, spans, more_pieces = setup.disturbance.programs()
        more_code = more_code.copy()
        more_code[more_code[:, 0] == 2, 1] += len(pieces)
        disturbance_span = np.array(spans, dtype=float)
        disturbance_span[:, 0] += len(code)
        code, pieces = np.vstack([code, more_code]), np.vstack([pieces, more_pieces])
    predecessors = setup.arrangement.predecessors if setup.arrangement else np.zeros((0, n))
    vertices = setup.figure.vertices if setup.figure else np.zeros((0, p))
    turns = setup.reforming.turns if setup.reforming else np.zeros((0, p, p))
    gains, law = setup.law.gains(), setup.law
    switching = law if isinstance(law, SlidingModeLaw) else SlidingModeLaw()  # the others do not switch

    phases = [Phase("", setup.behaviors), *setup.phases]
    ladder = [_level(setup, behavior) for phase in phases for behavior in phase.behaviors]
    starts = np.cumsum([0, *(len(phase.behaviors) for phase in phases)])

    header = np.zeros(SCALARS)
    header[:10] = [
        MAGIC, n, p, m, coordinates, len(ladder), len(predecessors), len(code), len(pieces), stride,
    ]  # fmt: skip
    header[10:28] = [
        setup.timestep, setup.seed, setup.radius, setup.target_feedforward, setup.max_speed,
        gains.kp, gains.kd, gains.k, gains.mu, gains.rho_hat_0,
        law.slope, switching.boundary_layer, SMOOTHINGS.index(switching.smoothing), law.anti_windup,
        setup.noise_position, setup.noise_velocity,
        setup.arrangement.length if setup.arrangement else 0.0,
        len(vertices),
    ]  # fmt: skip
    header[OUTER] = LOOP_KINDS[type(setup.outer)]
    if isinstance(setup.outer, PotentialField):
        header[OUTER + 1], header[OUTER_DISTANCE] = setup.outer.gain, setup.outer.least_distance
    elif isinstance(setup.outer, BarrierFilter):
        header[OUTER + 1] = setup.outer.rate
    header[LAW] = LAW_KINDS[type(law)]
    if isinstance(law, ComputedTorque):
        header[LAW + 1] = law.acceleration_filter
    header[TRUTH] = truth * (1 + law.has_lyapunov)
    header[35:37] = len(setup.failures), len(turns)
    header[37:39] = [len(phases), len(setup.kinds)]
    if setup.trigger is not None:
        trigger = setup.trigger
        header[39:43] = [trigger.distance, trigger.share, trigger.dwell, trigger.longest]
    blocks = (
        header,
        np.array(ladder),
        np.array([phase.row(int(start)) for phase, start in zip(phases, starts, strict=False)]),
        predecessors,
        vertices,
        setup.obstacle_position,
        setup.obstacle_radius,
        setup.robot_radius,
        setup.force_limit,
        target_span,
        disturbance_span,
        code,
        pieces,
        _failures(setup),
        *(setup.reforming.figures if setup.reforming else ()),
        turns,
    )
    return np.minimum(np.concatenate([np.ravel(block).astype(float) for block in blocks]), UNLIMITED)


def _level(setup: Setup, behavior: BehaviorParameters) -> list[float]:
    """One row of the ladder."""
    column = float(setup.kinds.index(behavior.behavior))
    if isinstance(behavior, AvoidObstacles):
        return [
            AVOID_OBSTACLES,
            behavior.safe_distance,
            setup.teammate_distance(behavior),
            behavior.gain_margin,
            behavior.measure == "surface",
            behavior.gain == "printed",
            behavior.sidestep,
            column,
        ]
    return [KINDS[type(behavior)], behavior.gain, 0.0, 0.0, 0.0, 0.0, 0.0, column]


def _failures(setup: Setup) -> Array:
    """What becomes of each robot's motors, shape (n, FAILURE_SIZE); no rows where none fails."""
    if not setup.failures:
        return np.zeros((0, FAILURE_SIZE))
    table = np.tile(NEVER, (setup.count, 1))
    for failure in setup.failures:
        table[failure.robot - 1] = failure.row(setup.force_limit[failure.robot - 1])
    return table
