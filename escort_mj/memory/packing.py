"""Packs what the controller is given into the flat vector of numbers that `unpack_plan` reads."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.component import Component, shipped_layout
from escort_mj.components.equations import Equations
from escort_mj.components.found import shipped
from escort_mj.components.parameters import UNLIMITED
from escort_mj.control.custom.native import block_of
from escort_mj.control.harmonics import sum_of, tabulate
from escort_mj.control.setup import Setup
from escort_mj.knowledge.belief import MADE
from escort_mj.memory.layout import LAYOUT, Plan
from escort_mj.memory.sampling import Sampling, signal_dimensions
from escort_mj.monitor.clearances import FAR_AWAY
from escort_mj.monitor.contacts import CELLS_PER_PAIR, PAIRS_PER_BODY
from escort_mj.monitor.sampling import samples_kept, steps_kept
from escort_mj.native.fields import Fields
from escort_mj.native.lanes import room_for
from escort_mj.numerics.neighbors import LISTED
from escort_mj.numerics.program import Op
from escort_mj.numerics.reform import scratch_size
from escort_mj.sensing.sensors import rows_of_past
from escort_mj.signals import SIGNALS, record_size, record_sizes

Array = NDArray[np.float64]


def pack(setup: Setup, sampling: Sampling, signals: Sequence[str] = ()) -> Array:
    """Pack a setup into the flat vector that `unpack_plan` reads.

    Args:
        setup: What the controller is given.
        sampling: When samples are taken, and of what.
        signals: Names of the signals that what is watched in every physics step is found from.
    """
    n, p, columns = setup.count, setup.axes, sampling.columns
    of_signals = signal_dimensions(setup, sampling)
    record = record_size(record_sizes(of_signals))
    values, blocks = _functions(setup), _Blocks(setup)
    blocks.placed(setup.law)  # comes first
    for owner in Plan.__bases__:
        if issubclass(owner, Fields):
            values |= {name: blocks.placed(value) for name, value in owner.packed(setup).items()}
    values["parameters"] = np.concatenate(blocks.blocks)
    values |= {
        "watched_group": [group for group, _ in columns],
        "watched_alone": [alone for _, alone in columns],
        "watched_radius": np.where(sampling.several or False, -FAR_AWAY, setup.robot_radius),
        "exact_within": sampling.exact_within,
        "distances_asked": not {"obstacle_distance", "robot_distance_min"}.isdisjoint(signals),
        "stride": sampling.stride,
        "extra": [*sampling.extra, np.inf],  # with room for one more, see `Plant.ending_at`
        "truth": sampling.truth,
        "lyapunov": sampling.truth and setup.has_lyapunov,
    }
    sizes, own = of_signals | LAYOUT.sizes(values), setup.sensing.own.values()
    crowd = n * (n >= LISTED)
    limits = sum(behavior.limits for behavior in setup.all_behaviors)
    sizes |= {
        "limited": limits * room_for(n),
        "remembering": n * bool(setup.memory),
        "corrected": n * (setup.outside == "residual"),
        "pushed": n * bool(setup.disturbances),
        "blown": n * any(each.draws for each in setup.disturbances),
        "blown_twice": n * any(each.draws > 1 for each in setup.disturbances),
        "mixed": n * bool(setup.laws),
        "ruled": n * any(phase.when is not None for phase in setup.phases),
        "turns": len(values["turns"]) // p,
        "modeled": n
        * any(law.needs_model for law in setup.all_laws),  # robots whose law is given their model
        "scanned": n * (setup.sensing.lidar is not None),
        "facing": n * setup.faces,
        "measuring": room_for(n) * bool(own),
        "sensor_memories": max((len(each.memories()) for each in own), default=0),
        "made": MADE * setup.estimating,
        "believed": setup.estimator.orders * p,
        "turned": n if setup.apart else 1,
        "apart": n * setup.apart,
        "bidding": n * setup.auctioned,
        "depth": setup.radio.depth(setup.timestep, n) if setup.radio else 0,
        "link_memories": len(setup.radio.memories()) if setup.radio else 0,
        "seen": (n + 1) * setup.shaped,
        "differentiating": n * any(law.differentiates for law in setup.all_laws),
        "pairs": PAIRS_PER_BODY * len(columns),
        "cells": CELLS_PER_PAIR * PAIRS_PER_BODY * len(columns),
        "crowd": crowd,
        "avoiding": crowd * setup.outer.avoids,
        "misled": crowd * (not setup.sensing.position.is_perfect),
        "past": rows_of_past(setup.sensing, n, setup.timestep),
        "kept": samples_kept(record) * sampling.kept,
        "record": record,
        "kept_steps": 0,
        "step_record": 0,
        "scratch": scratch_size(n, p) if setup.reforming else 0,
    }
    values["stretches"] = _stretches(sizes, [signal.name for signal in SIGNALS])
    sizes["stretches"] = len(values["stretches"])
    values["step_stretches"] = asked = _stretches(sizes, signals)
    sizes["step_stretches"] = len(asked)
    sizes["step_record"] = bool(signals) * (1 + int(asked[:, 1].sum()))
    sizes["kept_steps"] = steps_kept(sizes["step_record"])
    return np.minimum(LAYOUT.pack(sizes, values), UNLIMITED)


def _stretches(sizes: Mapping[str, int], signals: Iterable[str]) -> Array:
    """Where in the state the numbers of some signals stand, part by part: start and length."""
    places, found = LAYOUT.places(sizes), [(0, 0)]
    for name in signals:
        (start, length), (before, count) = places[name], found[-1]
        if start == before + count:
            found[-1] = before, count + length
        elif length:
            found.append((start, length))
    return np.array(found, float)


def _functions(setup: Setup) -> dict[str, Any]:
    """Programs of the functions of time, and where each has its instructions."""
    code, target, segments = setup.target.programs()
    moved = [mover.path for mover in setup.movers]
    spans: list[Array] = [np.asarray(target, dtype=float)]
    for function in (
        setup.disturbance,
        *moved,
        *(frame.function for frame in setup.formations),
        *setup.radii,
    ):
        if function is None:
            spans.append(np.zeros((setup.axes, 2)))
            continue
        more_code, more_spans, more_segments = function.programs()
        more_code = more_code.copy()
        more_code[more_code[:, 0] == Op.PIECEWISE, 1] += len(segments)
        spans.append(np.asarray(more_spans) + [len(code), 0])
        code, segments = np.vstack([code, more_code]), np.vstack([segments, more_segments])
    sums, radii = [], len(spans) - len(setup.radii)
    for span in (row for table in spans[:2] for row in table):
        first, count = map(int, span)
        sums.append(sum_of(code[first : first + count]))
        if sums[-1] is not None:
            span[:] = 0.0  # nothing is left to the program
    return {
        "code": code,
        "segments": segments,
        **tabulate(sums),
        "target": spans[0],
        "disturbance": spans[1],
        "mover_paths": np.reshape(spans[2 : 2 + len(moved)], (-1, 2)),
        "formation_frames": np.concatenate([np.zeros((0, 2)), *spans[2 + len(moved) : radii]]),
        "radius_functions": np.concatenate([np.zeros((0, 2)), *spans[radii:]]),
    }


class _Blocks:
    """The parameters of the components of a mission, one block behind the other."""

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        self.blocks: list[Array] = []
        self.end = 0

    def placed(self, value: Any) -> Any:
        """Return a value of the plan, in which places stand for components."""
        if isinstance(value, list | tuple):
            return [self.placed(each) for each in value]
        if not isinstance(value, Component):
            return value
        if type(value) in shipped:
            block = shipped_layout(type(value)).pack({"p": self.setup.axes}, value.packed(self.setup))
        else:
            assert isinstance(value, Equations), "what plugins bring"
            block = block_of(value, self.setup)
        self.blocks.append(block)
        self.end += len(block)
        return self.end - len(block)
