"""What is sampled of a mission beside what its setup says, and the sizes of all signals that follow."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.behaviors import LearnedBehavior
from escort_mj.behaviors.formation import waiting
from escort_mj.components.movers import kept_by
from escort_mj.control.setup import Setup
from escort_mj.sensing.sensors import readings_of

Array = NDArray[np.float64]


class Sampling(NamedTuple):
    """When samples are taken, and of what; by default of nothing that MuJoCo or expectations know.

    Attributes:
        stride: Every so many physics steps a sample is taken.
        extra: Physics steps of further samples, ascending.
        kept: Whether the callbacks keep samples until they are taken off.
        coordinates: Number of MuJoCo's generalized positions.
        truth: Whether the truth channel is recorded.
        groups: Number of groups of bodies whose clearances are recorded.
        columns: Which of these each body belongs to, and which is the body's own; -1 for none, shape
            (bodies, 2); empty where nothing is watched.
        several: Which robots are more than their hulls, shape (n,); empty where none is.
        exact_within: Clearance below which those of such robots are exact [m].
        watches: How many quantities of every physics step are recorded.
    """

    stride: int = 1
    extra: Sequence[int] = ()
    kept: bool = False
    coordinates: int = 0
    truth: bool = False
    groups: int = 0
    columns: Sequence[tuple[int, int]] = ()
    several: Sequence[bool] = ()
    exact_within: float = 0.0
    watches: int = 0


def signal_dimensions(setup: Setup, sampling: Sampling) -> dict[str, int]:
    """Return the sizes of the dimensions of signals in memory; 0 for signals that a mission does not have."""
    n, m, lidar = setup.count, len(setup.obstacle_radius), setup.sensing.lidar
    slots = setup.radio.senders(n).shape[1] if setup.radio is not None else 0
    rays = lidar.count(setup.axes) if lidar is not None and lidar.record else 0
    return {
        "n": n,
        "p": setup.axes,
        "m": m,
        "behaviors": len(setup.kinds),
        "coordinates": sampling.coordinates,
        "watched": sampling.groups,
        "known": n * sampling.truth,
        "judged": n * (sampling.truth and setup.has_lyapunov),
        "driven": n * setup.driven,
        "headed": n * setup.headed,
        "waiting": len(waiting(setup)),
        "learning": n * bool(setup.numbered(LearnedBehavior)),
        "estimating": n * setup.estimating,
        "hearing": n * bool(slots),
        "slots": slots,
        "returned": n * bool(rays),
        "rays": rays,
        "opponents": len(setup.opponent_places),
        "guarding": n * bool(setup.opponents),
        "teams": len(setup.teams),
        "members": n * bool(setup.teams),
        "escorted": m * bool(setup.teams),
        "movers": len(setup.movers),
        "several": n * any(sampling.several),
        "resized": n * bool(setup.radii),
        "watches": sampling.watches,
        "memories": len(setup.memory),
        "policy_values": sum(map(len, kept_by(setup))),
        "readings": len(readings_of(setup.sensing.own, setup.axes)),
    }
