"""Packs what the controller is told into the flat vector of numbers that `plan.unpack_plan` reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import BEHAVIORS, Behavior
from escort_mj.components.component import Component, shipped_layout
from escort_mj.components.parameters import UNLIMITED
from escort_mj.components.plan import (
    BARRIER_FILTER,
    CELLS_PER_PAIR,
    COLUMN,
    DRIVE_SIZE,
    FAILURE_SIZE,
    GAIN,
    IN_WORLD,
    KIND,
    LAYOUT,
    LEVEL_SIZE,
    LISTED,
    NSB,
    OUTSIDE,
    PAIRS_PER_BODY,
    PLACE,
    POTENTIAL_FIELD,
)
from escort_mj.control.custom.native import block_of
from escort_mj.control.failure import NEVER
from escort_mj.control.harmonics import sum_of, tabulate
from escort_mj.control.outer_loops import BarrierFilter, Nsb, PotentialField
from escort_mj.control.setup import Setup
from escort_mj.control.supervisor import Phase
from escort_mj.laws import LAWS, ApdSmc, Law
from escort_mj.laws.sliding import SMOOTHINGS, SlidingModeLaw
from escort_mj.numerics.program import Op
from escort_mj.numerics.reform import scratch_size
from escort_mj.sensing.sensors import sensor_table
from escort_mj.signals import SIGNALS

Array = NDArray[np.float64]

LOOP_KINDS = {Nsb: NSB, PotentialField: POTENTIAL_FIELD, BarrierFilter: BARRIER_FILTER}


def pack(
    setup: Setup,
    stride: int,
    coordinates: int,
    truth: bool = False,
    watched: int = 0,
    columns: Sequence[tuple[int, int]] = (),
    samples: tuple[int, int] = (0, 0),
    extra: Sequence[int] = (),
) -> Array:
    """Packs a setup into the flat vector that `unpack_plan` reads.

    Args:
        setup: What the controller is told.
        stride: Every so many physics steps a sample is taken.
        coordinates: Number of MuJoCo's generalized positions, for the record.
        truth: Whether to record the truth channel.
        watched: Groups of bodies whose clearances are recorded.
        columns: Which of these each body belongs to, and which is the body's own; -1 for none, shape
            (bodies, 2); empty where nothing is watched.
        samples: How many samples the callbacks keep until they are taken off, and the size of each.
        extra: Physics steps of further samples, ascending.
    """
    n, p, law = setup.count, setup.axes, setup.law
    phases = [Phase("", setup.behaviors), *setup.phases]
    behaviors = [behavior for phase in phases for behavior in phase.behaviors]
    parameters, places = _parameters(setup, behaviors)
    ladder = [_level(setup, *each) for each in zip(behaviors, places, strict=True)]
    starts = np.cumsum([0, *(len(phase.behaviors) for phase in phases)])
    figures = np.vstack([np.zeros((0, p)), *(setup.reforming.figures if setup.reforming else ())])
    sensors, bias, past = sensor_table(setup.sensing, n, p)
    arrays = _functions(setup) | {
        "parameters": parameters,
        "sensors": sensors,
        "bias": bias,
        "ladder": ladder,
        "phases": [phase.row(int(start)) for phase, start in zip(phases, starts, strict=False)],
        "predecessors": setup.arrangement.predecessors if setup.arrangement else np.zeros((0, n)),
        "vertices": setup.figure.vertices if setup.figure else np.zeros((0, p)),
        "obstacle_position": setup.obstacle_position,
        "obstacle_radius": setup.obstacle_radius,
        "robot_radius": setup.robot_radius,
        "force_limit": setup.force_limit,
        "force_limits": np.repeat(np.reshape(setup.force_limit, (-1, 1)), p, axis=1),
        "failures": _failures(setup),
        "figures": figures,
        "turns": (setup.reforming.turns if setup.reforming else np.zeros((0, p, p))).reshape(-1, p),
        "columns": np.reshape(np.asarray(columns, dtype=float), (-1, 2)),
        "extra": np.asarray(extra, dtype=float),
    }
    sizes = {name: len(arrays[name]) for name in ("phases", "vertices", "pieces")}
    vertices = sizes["vertices"]
    sizes |= {
        "n": n,
        "p": p,
        "m": len(setup.obstacle_radius),
        "coordinates": coordinates,
        "behaviors": len(setup.kinds),
        "levels": len(ladder),
        "parameters": len(parameters),
        "memories": law.memories,
        "cycles": len(arrays["predecessors"]),
        "tones": np.shape(arrays["tones"])[1],
        "followed": np.shape(arrays["lines"])[1],
        "instructions": len(arrays["code"]),
        "failing": len(arrays["failures"]),  # n, or 0 where no robot fails
        "points": len(figures),
        "turns": len(arrays["turns"]) // p,
        "known": n * truth,  # robots whose truth is recorded
        "judged": n * (truth and law.has_lyapunov),
        "told": n * law.needs_model,  # robots whose law is told their model
        "movers": len(setup.movers),
        "seen": (n + 1) * setup.shaped,
        "differentiating": n * law.differentiates,
        "bodies": len(columns),
        "extra": len(extra),
        "watched": watched,
        "pairs": PAIRS_PER_BODY * len(columns),
        "cells": CELLS_PER_PAIR * PAIRS_PER_BODY * len(columns),
        "held": p + 3,
        "crowd": n * (n >= LISTED),
        "misled": n * (n >= LISTED and not setup.sensing.position.is_perfect),
        "biased": len(bias),
        "past": past,
        "kept": samples[0],
        "record": samples[1],
        "scratch": scratch_size(n, p) if setup.failures and vertices else 0,
    }
    arrays["stretches"] = _stretches(sizes)
    sizes["stretches"] = len(arrays["stretches"])
    values = _scalars(setup) | arrays | {"stride": stride, "truth": truth}
    values["lyapunov"] = truth and law.has_lyapunov
    return np.minimum(LAYOUT.pack(sizes, values), UNLIMITED)


def _stretches(sizes: Mapping[str, int]) -> Array:
    """Where in the state the numbers of a record stand, part by part: start and length."""
    places, found = LAYOUT.places(sizes), [(0, 0)]
    for signal in SIGNALS:
        (start, length), (before, count) = places[signal.name], found[-1]
        if start == before + count:
            found[-1] = before, count + length
        elif length:
            found.append((start, length))
    return np.array(found, float)


def _scalars(setup: Setup) -> dict[str, float]:
    """Numbers of the plan, by name."""
    law, outer, trigger = setup.law, setup.outer, setup.trigger
    sliding = law if isinstance(law, SlidingModeLaw) else ApdSmc()  # the others have no Lyapunov function
    gain = distance = 0.0
    if isinstance(outer, PotentialField):
        gain, distance = outer.gain, outer.least_distance
    elif isinstance(outer, BarrierFilter):
        gain = outer.rate
    return {
        "timestep": setup.timestep,
        "seed": setup.seed,
        "radius": setup.radius,
        "target_feedforward": setup.target_feedforward,
        "max_speed": setup.max_speed,
        "outer": OUTSIDE if setup.outside else LOOP_KINDS[type(outer)],
        "outer_gain": gain,
        "outer_distance": distance,
        "law": OUTSIDE if setup.outside == "force" else _number(law, LAWS),
        "acceleration_filter": getattr(law, "acceleration_filter", 0.0),
        "estimate_at_start": law.estimate_at_start,
        "slope": law.slope,
        **sliding.gains()._asdict(),
        "boundary_layer": sliding.boundary_layer,
        "smoothing": SMOOTHINGS.index(sliding.smoothing),
        "anti_windup": law.anti_windup,
        "chord_length": setup.arrangement.length if setup.arrangement else 0.0,
        "trigger_distance": trigger.distance if trigger else 0.0,
        "trigger_share": trigger.share if trigger else 0.0,
        "trigger_dwell": trigger.dwell if trigger else 0.0,
        "trigger_longest": trigger.longest if trigger else 0.0,
        "shaped": setup.shaped,
        "perfect": all(channel.is_perfect for channel in setup.sensing.channels),
        "alike": not (setup.phases or setup.failures or setup.trigger or setup.outside),
        "nearest_within": setup.nearest_within,
        "sensing_robots": setup.sensing.robots,
        "sensing_obstacles": setup.sensing.obstacles,
    }


def _functions(setup: Setup) -> dict[str, Array]:
    """Programs of the functions of time, and where each has its instructions."""
    code, target, pieces = setup.target.programs()
    spans: list[Array] = [np.asarray(target, dtype=float)]
    for function in (setup.disturbance, *(mover.path for mover in setup.movers)):
        if function is None:
            spans.append(np.zeros((setup.axes, 2)))
            continue
        more_code, more_spans, more_pieces = function.programs()
        more_code = more_code.copy()
        more_code[more_code[:, 0] == Op.PIECEWISE, 1] += len(pieces)
        spans.append(np.asarray(more_spans) + [len(code), 0])
        code, pieces = np.vstack([code, more_code]), np.vstack([pieces, more_pieces])
    sums = []
    for span in (row for table in spans[:2] for row in table):
        first, count = map(int, span)
        sums.append(sum_of(code[first : first + count]))
        if sums[-1] is not None:
            span[:] = 0.0  # nothing is left to the program
    drives = [[mover.mass, mover.force_limit, mover.gain, mover.obstacle] for mover in setup.movers]
    return {
        "code": code,
        "pieces": pieces,
        **tabulate(sums),
        "target": spans[0],
        "disturbance": spans[1],
        "drives": np.reshape(drives, (-1, DRIVE_SIZE)),
        "paths": np.reshape(spans[2:], (-1, 2)),
    }


def _parameters(setup: Setup, behaviors: Sequence[Behavior]) -> tuple[Array, list[int]]:
    """Return the parameters of law and behaviors as kernels read them, and where each behavior's begin."""
    blocks, places, end = [], [], 0
    everything: list[Law | Behavior] = [setup.law, *behaviors]
    for each in everything:
        ships = type(each) in (*LAWS, *BEHAVIORS)
        places.append(end)
        if ships:
            layout = shipped_layout(type(each))
            blocks.append(layout.pack({"p": setup.axes}, each.packed(setup)))
        else:
            blocks.append(block_of(each, setup.axes))
        end += len(blocks[-1])
    return np.concatenate(blocks), places[1:]


def _number(member: Component, known: Sequence[type[Component]]) -> int:
    """Return the place of a component's class among those that ship; one past them for a plugin's."""
    return known.index(type(member)) if type(member) in known else len(known)


def _level(setup: Setup, behavior: Behavior, place: int) -> list[float]:
    """Return one row of the ladder."""
    row = [0.0] * LEVEL_SIZE
    row[KIND], row[PLACE] = _number(behavior, BEHAVIORS), place
    row[COLUMN] = setup.kinds.index(behavior.behavior)
    row[GAIN], row[IN_WORLD] = behavior.convergence, behavior.frame == "world"
    return row


def _failures(setup: Setup) -> Array:
    """What becomes of each robot's motors, shape (n, FAILURE_SIZE); no rows where none fails."""
    if not setup.failures:
        return np.zeros((0, FAILURE_SIZE))
    table = np.tile(NEVER, (setup.count, 1))
    for failure in setup.failures:
        table[failure.robot - 1] = failure.row(setup.force_limit[failure.robot - 1])
    return table
