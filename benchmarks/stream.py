"""`python -m benchmarks.stream`: share of a stream of intruders that one robot stops, for docs/pursuit.md."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import escort_mj
from benchmarks.document import measure_page, table
from benchmarks.perimeter import SPEED, defense

PAGE = "pursuit.md"
PERIMETER = 2.0  # radius [m]
CAUGHT = 0.02  # gap at which the defender has caught an intruder [m]: 1 % of the radius
INTRUDER, FAR = 1.0, 7.0  # speed of intruders [m/s], and how far from the perimeter they start [m]
LOADS = (0.5, 1.0, 2.0, 4.0)  # mean number of intruders while the defender runs half of the perimeter
MISSIONS, STREAM = 120, 20


def closed_form(load: float) -> float:
    """Return the share that a defender stops that always runs for the next intruder to arrive.

    An intruder's direction does not depend on where the defender is, so the arc between them is uniform up
    to half of the perimeter, and the time since the one before is exponential:
    E[min(1, v g / (pi R))] = (1 - exp(-a)) / a with a = rate pi R / v.
    """
    return (1.0 - math.exp(-load)) / load


def stopped(load: float, seed: int) -> float:
    """Return which share is stopped in a mission, of all but the first intruder."""
    random = np.random.default_rng(seed)
    gaps = random.exponential(math.pi * PERIMETER / SPEED / load, STREAM)
    starts, angles = np.cumsum(gaps), random.uniform(-math.pi, math.pi, STREAM)
    away = (PERIMETER + FAR) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    opponents: list[dict[str, Any]] = [
        {
            "name": f"from_{number}", "positions": [place.tolist()], "start": float(start),
            "capture_distance": CAUGHT, "policy": {"policy": "straight", "speed": INTRUDER},
        }
        for number, (start, place) in enumerate(zip(starts, away, strict=True))
    ]  # fmt: skip
    keys: dict[str, Any] = {
        "duration": float(starts[-1]) + (FAR + 1.0) / INTRUDER,
        "physics": {"timestep": 0.005},
        "recording": {"rate": 10},
    }
    found = escort_mj.run(keys | defense(PERIMETER, opponents)).trace["opponent_status"].values[-1]
    return float((found[1:] == 2.0).mean())


def tables() -> dict[str, str]:
    """Flies all missions, prints the table, and writes it into the docs if asked."""
    rows = []
    for load in LOADS:
        shares = np.array([stopped(load, seed) for seed in range(MISSIONS)])
        error = 1.96 * shares.std(ddof=1) / math.sqrt(MISSIONS)
        measured = f"{100.0 * shares.mean():.1f} ± {100.0 * error:.1f}"
        rows.append([f"{load:g}", f"{100.0 * closed_form(load):.1f}", measured])
        print(rows[-1], flush=True)
    head = ["intruders in the time for half of the perimeter", "stopped, theory [%]", "measured [%]"]
    return {"stream": table(head, rows)}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
