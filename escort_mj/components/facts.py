"""What of a mission decides whether a component fits it, and what a component says that does not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple


class Facts(NamedTuple):
    """A mission, as far as components may be made for others.

    Attributes:
        axes: Dimension of the space.
        robots: Number of robots.
        robot_radius: Radius of the largest [m].
        target_radius: Radius of the target [m]; 0 without one.
        radius: Distance to the target at which robots are to be [m].
        spacing: Distance of neighbors where behaviors spread robots evenly [m]; infinite where none does.
        target: Whether there is one target that all escort.
        teams: Whether there are teams, each with its targets.
        known_by: Table by which each robot knows only what it sees and hears: `knowledge` or
            `communication`; empty where all know all.
        heard: Whether robots send each other messages.
        heard_within: Distance of centers within which they hear each other [m]; None without a limit.
        seen_within: Distances within which they see robots, and obstacles [m]; None without a limit.
        failures: Whether some robots fail.
        opponents: Whether there are opponents.
        lidar: Whether robots see obstacles by a lidar.
        max_speed: Limit of their speed [m/s]; None without one.
        force_limits: Limit of the force of each per axis [N]; None without one.
        timestep: Physics step [s].
    """

    axes: int
    robots: int
    robot_radius: float
    target_radius: float
    radius: float
    spacing: float
    target: bool
    teams: bool
    known_by: str
    heard: bool
    heard_within: float | None
    seen_within: tuple[float | None, float | None]
    failures: bool
    opponents: bool
    lidar: bool
    max_speed: float | None
    force_limits: tuple[float | None, ...]
    timestep: float


class Misfit(NamedTuple):
    """What of a component does not fit a mission.

    Attributes:
        words: What was found, and what is expected.
        key: Of its table, or where in the table that a key holds; empty for all of it.
        because: Keys of the scenario that make it so.
    """

    words: str
    key: str | tuple[str | int, ...] = ""
    because: tuple[tuple[str, ...], ...] = ()


def one_each(found: int, robots: int, key: str) -> Misfit:
    """Return what does not fit of a list that has not one entry for each robot."""
    words = f"found {found} entries; expected {robots}, one for each robot"
    return Misfit(words, key, (("robots", "count"), ("robots", "positions")))


def robots_known(found: Sequence[int], robots: int, *key: str | int) -> Iterator[Misfit]:
    """Yield what does not fit of a list of robots, by their numbers: those that exist, each once."""
    if wrong := [robot for robot in found if robot > robots]:
        yield Misfit(f"found robot {wrong[0]}; allowed are 1 to {robots}", key)
    if len(set(found)) < len(found):
        yield Misfit(f"found {', '.join(map(str, found))}; expected each robot once", key)
