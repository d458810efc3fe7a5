"""`python -m benchmarks.orca`: robots that change places, here and by ORCA from the same starts.

ORCA has an environment of its own, made on first use; without it, its rows say so.
"""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import escort_mj
from benchmarks.document import measure_page, table
from benchmarks.peers.environments import NotInstalled, python_of
from escort_mj.behaviors import Goal

PAGE = "goals.md"
ADAPTER = Path(__file__).parent / "peers" / "fly_orca.py"
DRAWN = 10  # teams whose starts are off the circle
OFF = 0.3  # by at most so much along each axis [m]
PLAIN = {"step": 0.02, "horizon": 2.0, "sees": 3.0, "neighbors": 10, "turn": 0.0}
WAYS = {
    "ORCA": PLAIN,
    "ORCA, range 15 m, horizon 10 s": PLAIN | {"horizon": 10.0, "sees": 15.0},
    "ORCA, steps of 0.1 s": PLAIN | {"step": 0.1},
    "ORCA, turned by 0.1 rad": PLAIN | {"turn": 0.1},
}
Flown = dict[str, float]


def ours(scenario: Any) -> Flown:
    """A mission flown here."""
    found = escort_mj.run(scenario.replace({"expect": []})).metrics
    names = {"makespan": "arrival_time", "gap": "robot_clearance_min", "arrived": "arrived"}
    row = {short: found[name]["value"] for short, name in names.items()}
    row["way"] = found["path_length"]["value"]
    return {name: float("nan") if value is None else float(value) for name, value in row.items()}


def theirs(teams: list[Any], way: dict[str, Any]) -> list[Flown]:
    """The same starts by ORCA; discs are larger by half the safe distance, so that both keep it.

    Raises:
        NotInstalled: Why it cannot be flown.
    """
    told = []
    for team in teams:
        starts = np.array(team.robots.positions)
        margin = 0.5 * team.mission.behaviors[0].safe_distance
        told.append(
            way | {
                "starts": starts.tolist(), "goals": (2.0 * starts.mean(axis=0) - starts).tolist(),
                "radius": team.robots.radius + margin, "speed": team.mission.max_speed,
                "duration": team.duration, "reach": reach_of(team), "seed": team.seed,
            }
        )  # fmt: skip
    command = [str(python_of("orca")), str(ADAPTER)]
    done = subprocess.run(command, input=json.dumps(told), capture_output=True, text=True, check=True)
    found: list[Flown] = json.loads(done.stdout)
    for row, team in zip(found, teams, strict=True):
        row["gap"] += team.mission.behaviors[0].safe_distance
    return found


def reach_of(team: Any) -> float:
    """Distance from its goal within which a robot has arrived [m], for both."""
    (goal,) = (each for each in team.mission.behaviors if isinstance(each, Goal))
    return goal.reach


def line(name: str, teams: str, found: list[Flown], best: list[Flown]) -> list[str]:
    """One row: medians over teams, and of the ratios to ours where both arrive."""
    whole = [row["arrived"] == 1.0 for row in found]
    cells = [teams, name, f"{sum(whole)} of {len(found)}"]
    for key, digits in (("makespan", 1), ("way", 2)):
        values = np.array([row[key] for row in found])[whole]
        ratios = np.array([row[key] / mine[key] for row, mine in zip(found, best, strict=True)])[whole]
        cells.append(f"{_median(values):.{digits}f} ({_median(ratios):.2f})" if any(whole) else "")
    return [*cells, f"{min(row['gap'] for row in found):.3f}"]


def _median(values: NDArray[np.float64]) -> float:
    return float(np.nanmedian(values))


def off_the_circle(circle: Any) -> list[Any]:
    """Teams whose starts are drawn near those of the circle."""
    teams = []
    for seed in range(1, DRAWN + 1):
        starts = np.array(circle.robots.positions)
        starts += np.random.default_rng(seed).uniform(-OFF, OFF, starts.shape)
        teams.append(circle.replace({"seed": seed, "robots.positions": starts.tolist()}))
    return teams


def tables() -> dict[str, str]:
    """Flies all."""
    circle = escort_mj.load_scenario("goals/swap_32")
    space = escort_mj.load_scenario("goals/swap_space_100")
    rows = []
    for name, teams in (("circle of 32", [circle]), ("32 near a circle", off_the_circle(circle))):
        best = [ours(team) for team in teams]
        rows.append(line("here", name, best, best))
        try:
            for way, numbers in WAYS.items():
                rows.append(line(way, name, theirs(teams, numbers), best))
        except NotInstalled as reason:
            rows.append([name, f"ORCA: not installed ({reason})", "", "", "", ""])
    mine, starts = ours(space), np.array(space.robots.positions)
    assert space.mission.max_speed is not None, "the mission bounds its robots' speed"
    straight = 2.0 * np.linalg.norm(starts - starts.mean(axis=0), axis=1)
    least = {
        "makespan": float(straight.max()) / space.mission.max_speed, "way": float(straight.mean()),
        "gap": float("nan"), "arrived": 1.0,
    }  # fmt: skip
    rows += [
        line("here", "sphere of 100", [mine], [mine]),
        [*line("straight through each other", "sphere of 100", [least], [mine])[:-1], ""],
    ]
    head = ["starts", "method", "arrive", "makespan [s] (ratio)", "mean path [m] (ratio)", "least gap [m]"]
    return {"orca": table(head, rows)}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
