"""`python -m benchmarks.dashes`: at what speed a target dashes out of an even circle, for docs/pursuit.md."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

import escort_mj
from benchmarks.document import DOCS, publish, table, wants_docs
from benchmarks.perimeter import LAW, POINT
from escort_mj import palette
from escort_mj.report.figures.drawing.style import figure, legend

PAGE, PICTURE = "pursuit.md", DOCS / "figures" / "dashes.png"
COUNTS = range(4, 13)
CIRCLE, SPEED = 5.0, 1.0  # radius [m] and speed of the robots [m/s]
FINE = 1e-3  # of the ratio


class Team(NamedTuple):
    """What robots are.

    Attributes:
        radius: Theirs and the target's [m].
        mass: [kg].
        force: Limit of their motors [N]; None for none.
    """

    radius: float
    mass: float = 1.0
    force: float | None = None

    def ratio(self, count: float) -> float:
        """Return the ratio of speeds up to which theory closes the circle.

        A target that dashes through the middle of a gap passes a point robot at R sin(pi / n - phi), with sin
        phi the ratio of the robot's speed to its own. Bodies may miss by both radii. Motors push along the
        axes: a robot that speeds up to v in the direction u loses v^2 m / 2F (|u_x|^3 + |u_y|^3) of its way.
        Robot 1 goes along an axis, and robot 2 is its mirror image.
        """
        heading = 2.0 * math.pi / count - 0.5 * math.pi
        share = min(1.0, abs(math.cos(heading)) ** 3 + abs(math.sin(heading)) ** 3)
        lag = 0.0 if self.force is None else 0.5 * share * SPEED**2 * self.mass / self.force
        return 1.0 / math.sin(math.pi / count - math.asin((2.0 * self.radius - lag) / CIRCLE))


TEAMS = {
    "points": Team(POINT),
    "0.1 m": Team(0.1),
    "0.3 m": Team(0.3),
    "0.3 m, 1 kg, 2 N": Team(0.3, 1.0, 2.0),
    "0.3 m, 4 kg, 2 N": Team(0.3, 4.0, 2.0),
}


def is_caught(team: Team, count: int, ratio: float) -> bool:
    """Whether a robot touches a target that dashes through the middle of a gap."""
    turns, out = 2.0 * math.pi * np.arange(count) / count, math.pi / count
    path = [f"{ratio * SPEED * part}*t" for part in (math.cos(out), math.sin(out))]
    robots = {
        "positions": (CIRCLE * np.column_stack([np.cos(turns), np.sin(turns)])).tolist(),
        "radius": team.radius,
        "mass": team.mass,
        "force_limit": team.force,
    }
    behavior = {"behavior": "intercept", "within": team.radius, "gain": 100.0}
    keys: dict[str, Any] = {
        "duration": 1.6 * CIRCLE / ratio,
        "physics": {"timestep": 5e-4},
        "target": {"radius": team.radius, "position": path, "body": {}},
        "robots": robots,
        "mission": {"radius": CIRCLE, "max_speed": SPEED, "behaviors": [behavior]},
        "controller": LAW,
    }
    return math.isfinite(escort_mj.run(keys).values["caught"])


def measured(team: Team, count: int) -> float:
    """Return the ratio of speeds up to which robots catch the target, by bisection."""
    low, high = (math.log(share * team.ratio(count)) for share in (0.5, 2.0))
    while high - low > FINE:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_caught(team, count, math.exp(middle)) else (low, middle)
    return math.exp(0.5 * (low + high))


def draw(found: dict[tuple[str, int], float]) -> None:
    """Draw what is measured as marks on the curves of theory."""
    colors = palette.robot_colors(len(TEAMS))
    with figure(PICTURE, 3.6, "Speed that gets out of an even circle of robots") as canvas:
        axes, keys = canvas.subplots(), []
        counts = np.linspace(COUNTS[0], COUNTS[-1], 100)
        for (name, team), color in zip(TEAMS.items(), colors, strict=True):
            axes.plot(counts, [team.ratio(count) for count in counts], color=color, linewidth=0.9)
            marks = axes.plot(COUNTS, [found[name, n] for n in COUNTS], "o", color=color, markersize=4.0)
            keys.append((name, marks[0]))
        axes.set_xlabel("robots")
        axes.set_ylabel("speed of the target / of the robots")
        legend(canvas, keys)


def main() -> None:
    """Measures all, prints the table, and writes it and the figure into the docs if asked."""
    write = wants_docs(__doc__, PAGE)
    found, rows = {}, []
    for count in COUNTS:
        row = [str(count)]
        for name, team in TEAMS.items():
            found[name, count] = ratio = measured(team, count)
            row.append(f"{ratio:.3f} ({ratio / team.ratio(count):.3f})")
        rows.append([row[0], f"{1.0 / math.sin(math.pi / count):.3f}", *row[1:]])
        print(rows[-1], flush=True)
    publish(PAGE, {"dashes": table(["robots", "1 / sin(pi / n)", *TEAMS], rows)}, write)
    if write:
        draw(found)


if __name__ == "__main__":
    main()
