"""What of a mission decides whether a component fits it, and what a component says that does not."""

from __future__ import annotations

from typing import NamedTuple


class Facts(NamedTuple):
    """A mission, as far as components may be made for others.

    Attributes:
        axes: Dimension of the space.
        robots: Number of robots.
        target: Whether there is one target that all escort.
        teams: Whether there are teams, each with its targets.
        known_by: Table by which each robot knows only what it sees and hears: `knowledge` or
            `communication`; empty where all know all.
        heard: Whether robots send each other messages.
        failures: Whether some robots fail.
        opponents: Whether there are opponents.
        lidar: Whether robots see obstacles by a lidar.
        max_speed: Limit of their speed [m/s]; None without one.
        force_limits: Limit of the force of each per axis [N]; None without one.
        timestep: Physics step [s].
    """

    axes: int
    robots: int
    target: bool
    teams: bool
    known_by: str
    heard: bool
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
        key: Of its table; empty for all of it.
        because: Keys of the scenario that make it so.
    """

    words: str
    key: str = ""
    because: tuple[tuple[str, ...], ...] = ()
