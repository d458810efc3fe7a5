"""Touches of robots, target, obstacles and walls."""

from __future__ import annotations

import numpy as np

from escort_mj.metrics.measure import Measure
from escort_mj.metrics.metric import metric
from escort_mj.record.episodes import apart_from, by_geometry, during, pair
from escort_mj.record.recording import Recorded, require_places

FORCELESS = "touches were found by geometry, which knows no force"


def touches_within(trace: Recorded) -> Recorded:
    """Episodes within the trace's samples between bodies other than the floor."""
    time = trace["time"].values
    found = during(trace, float(time[0]), float(time[-1]))
    apart = apart_from(found, "floor")
    return found if apart.all() else found.isel(episode=apart)


@metric(unit="1", grows=True, watched=False, rank=180, every_step=True)
def contacts(trace: Recorded) -> Measure:
    """Number of touches between robots, target, obstacles and walls."""
    require_places(trace)
    found = touches_within(trace)
    count = found.sizes["episode"]
    if not count:
        return Measure(0.0)
    return Measure(
        float(count), max(float(found["episode_start"][0]), float(trace["time"][0])), pair(found, 0)
    )


@metric(unit="N", grows=True, watched=False, rank=190, every_step=True)
def contact_force_max(trace: Recorded) -> Measure:
    """Largest normal force between robots, target, obstacles and walls."""
    require_places(trace)
    found = touches_within(trace)
    if by_geometry(found).any():
        return Measure(None, reason=FORCELESS)
    forces = found["episode_peak_force"].values
    if not forces.any():
        return Measure(0.0)
    hardest = int(np.argmax(forces))
    return Measure(float(forces[hardest]), float(found["episode_peak_time"][hardest]), pair(found, hardest))


@metric(unit="1", grows=True, watched=False, rank=200, every_step=True)
def contacts_untold(trace: Recorded) -> Measure:
    """Number of contacts that did not fit into the contact log."""
    total = trace["contacts_untold"].values
    return Measure(float(total[-1] - total[0]))
