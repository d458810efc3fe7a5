"""`python -m benchmarks.perimeter`: who wins in perimeter defense, one against one, for docs/pursuit.md."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

import escort_mj
from benchmarks.document import measure_page, table

PAGE = "pursuit.md"
PERIMETER, SPEED = 5.0, 1.0  # radius [m] and speed of the defender [m/s]
POINT = 1e-3  # radius of the bodies [m]
CAUGHT = 0.1  # gap at which the defender has caught the intruder [m]: 2 % of the radius, within the band
RATIOS = (0.5, 0.7, 0.9)  # speed of the intruder / of the defender
STARTS, BAND = 500, 0.05
FARTHEST = 2.2  # of the perimeter's radius
LAW = {"law": "computed_torque", "position_gain": 0.0, "velocity_gain": 400.0, "acceleration_filter": 0.0}
ANGLES = np.linspace(0.0, math.pi, 20001)


def lead(distance: float, angle: float, ratio: float) -> float:
    """Return by how much an intruder that plays best is ahead of a defender that plays best [s].

    The intruder runs straight to a point of the perimeter, and the defender along it to the same point: the
    greatest lead over all points that it sees decides (Shishika, Kumar 2018).

    Args:
        distance: Of the intruder from the center [m].
        angle: Between intruder and defender as seen from the center [rad], 0 to pi.
        ratio: Speed of the intruder / of the defender.
    """
    own = np.hypot(
        PERIMETER * np.cos(ANGLES) - distance * math.cos(angle),
        PERIMETER * np.sin(ANGLES) - distance * math.sin(angle),
    )
    seen = distance * np.cos(ANGLES - angle) >= PERIMETER
    ahead = PERIMETER * ANGLES / SPEED - own / (ratio * SPEED)
    return float(ahead[seen].max(initial=-math.inf))


def starts(ratio: float, random: np.random.Generator) -> list[tuple[float, float, bool]]:
    """Draw starts of the intruder outside the band around the barrier: distance, angle, whether it wins."""
    found: list[tuple[float, float, bool]] = []
    while len(found) < STARTS:
        distance, angle = PERIMETER * random.uniform(1.02, FARTHEST), random.uniform(-math.pi, math.pi)
        near, far = (lead(max(distance * s, PERIMETER), abs(angle), ratio) for s in (1.0 - BAND, 1.0 + BAND))
        if (near > 0.0) == (far > 0.0):
            found.append((distance, angle, near > 0.0))
    return found


def defense(perimeter: float, intruders: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the mission of one robot that guards a perimeter of this radius [m]; all bodies are points."""
    return {
        "target": {"radius": POINT},
        "robots": {"positions": [[perimeter, 0.0]], "radius": POINT},
        "opponents": [
            {"radius": POINT, "body": {"mass": 0.01}, "reach_distance": perimeter - 2.0 * POINT} | each
            for each in intruders
        ],
        "mission": {
            "radius": perimeter, "max_speed": SPEED,
            "behaviors": ["surface", {"behavior": "guard", "gain": 50.0}],
        },
        "controller": LAW,
    }  # fmt: skip


def is_breached(distance: float, angle: float, ratio: float) -> bool:
    """Whether the intruder comes in, in a mission."""
    place = [distance * math.cos(angle), distance * math.sin(angle)]
    intruder: dict[str, Any] = {
        "positions": [place],
        "capture_distance": CAUGHT,
        "policy": {
            "policy": "breach", "speed": ratio * SPEED, "perimeter": PERIMETER, "rival_speed": SPEED,
            "interval": 0.02,
        },
    }  # fmt: skip
    duration = {"duration": 1.5 * math.pi * PERIMETER / (ratio * SPEED)}
    return escort_mj.run(duration | defense(PERIMETER, [intruder])).values["opponents_breached"] == 1.0


def share(outcomes: NDArray[np.bool_]) -> str:
    """Return a share in percent."""
    return f"{100.0 * outcomes.mean():.1f}" if len(outcomes) else "none"


def tables() -> dict[str, str]:
    """Flies all starts, prints the table, and writes it into the docs if asked."""
    rows = []
    for ratio in RATIOS:
        drawn = starts(ratio, np.random.default_rng(4144))
        told = np.array([wins for *_, wins in drawn])
        flown = np.array([is_breached(distance, angle, ratio) for distance, angle, _ in drawn])
        agree = flown == told
        rows.append(
            [f"{ratio:g}", share(told), share(flown), share(agree), share(agree[told]), share(agree[~told])]
        )
        print(rows[-1], flush=True)
    head = ["speed ratio", "intruder wins, theory [%]", "measured [%]", "agree [%]"]
    head += ["of those won by the intruder [%]", "by the defender [%]"]
    return {"perimeter": table(head, rows)}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
