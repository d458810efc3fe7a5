"""What robots observe and what is asked of them, for several missions of one scenario.

Machine code finds both for a mission that has just been stepped (`memory.perception`), in that mission's own
memory, and writes them into arrays of all missions, from which learners get theirs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from escort_mj.components.setup import Outside
from escort_mj.control.setup import Setup
from escort_mj.environments.own import Now, Own, Part
from escort_mj.errors import UsageError
from escort_mj.knowledge.observation import TEAMMATES, observed_speed, vectors_observed
from escort_mj.memory.perception import SETTINGS, WEIGHTS, perception_of
from escort_mj.numerics.thomson import even_points, nearest_edges
from escort_mj.scenario.arguments import Bound, number
from escort_mj.signals import columns
from escort_mj.world.plant import Plant

Array = NDArray[np.float64]
Seen = NDArray[np.float32]
Command = Outside

FASTEST = 100.0  # largest observed velocity, in largest commanded speeds
SUSPICIOUS = 0.999  # of the distance to the target at which a mission ends


@dataclass(frozen=True)
class Reward:
    """What is asked of each robot at each command, as weights of terms without units.

    In missions with teams, radius, target, teammates and the even formation are those of the robot's team.

    Attributes:
        radius: Of the distance to the sphere around the target, in radii.
        spacing: Of the lack of distance to the nearest teammate, as a share of the even formation's spacing.
        command: Of the mean square of the scaled command.
        clearance: Of the lack of distance to anything, as a share of `avoid_obstacles`' safe distance.
        touch: Of having touched anything since the last command. A mission has thousands of commands: with
            less than this it pays to run into obstacles rather than to go around them.
        breach: Of each opponent that has reached the target since the last command, for every robot.
        capture: Of each opponent that the robot has intercepted since then.
    """

    radius: float = 1.0
    spacing: float = 1.0
    command: float = 0.01
    clearance: float = 1.0
    touch: float = 100.0
    breach: float = 100.0
    capture: float = 10.0

    def __post_init__(self) -> None:
        check_weights(self)


def check_weights(reward: object) -> None:
    """Refuse weights that are no finite numbers.

    Raises:
        UsageError: With the first of them.
    """
    for name, value in vars(reward).items():
        number(value, name, "a weight, a finite number", Bound())


class Senses:
    """Observations and rewards of N missions with n robots in p axes.

    Attributes:
        count: N.
        robots: n.
        axes: p.
        width: How many numbers a robot observes.
        scale: What a command of 1 means, shape (N, n, 1) [m/s or N].
        commanded: The last commands, shape (N, n, p), from -1 to 1.
        own: What is one's own of both.
        rewards: Of each robot for the last command, shape (N, n).
        terms: What these are sums of, in the order of the fields of `Reward`, shape (N, n, 7).
        clearance: Least distance of each robot to anything since the last command, shape (N, n) [m].
        sound: 0 where something in a mission's state may be wrong, shape (N, 1).
    """

    def __init__(
        self, plant: Plant, count: int, command: Command, reward: Reward, own: Sequence[Part] = ()
    ) -> None:
        """Prepare for missions.

        Args:
            plant: Where each of them takes place until it enters another.
            count: N.
            command: What is commanded.
            reward: Weights of what is asked.
            own: Observations and rewards of one's own.

        Raises:
            UsageError: If there is no target, or if forces are to be commanded without a limit.
        """
        world = plant.world
        self.count, self._command, self._sizes = count, command, world.sizes
        self.robots, self.axes = world.sizes["robot"], world.sizes["axis"]
        self.own = Own(own, (count, self.robots))
        self._mates = min(self.robots - 1, TEAMMATES)
        self._opposed = bool(world.setup.opponents)
        width = vectors_observed(self.robots, int(self._opposed)) * self.axes
        self.width = width + len(self.own.limits)
        radii = [radius for team in world.setup.teams for radius in world.setup.radii_of(team)]
        self._least_radius = min(radii or [world.setup.radius])
        n, sizes, self._reward = self.robots, self._sizes, reward
        settings = dict.fromkeys(SETTINGS, 0.0) | asdict(reward)
        settings |= {"begin": columns("q", sizes).start, "end": columns("disturbance", sizes).stop}
        even = np.ones(max(len(world.setup.teams), 1) * n)
        self._settings = np.tile(np.append(list(settings.values()), even), (count, 1))
        self.scale = np.zeros((count, n, 1))
        self.commanded: Array = np.zeros((count, n, self.axes))
        found = np.zeros((count, 2 + n * (3 + len(WEIGHTS) + width)))
        ends = [1, 2, 2 + n, 2 + 2 * n, 2 + 3 * n, 2 + (3 + len(WEIGHTS)) * n]
        self.sound, _, self.rewards, _, self.clearance, terms, observed = np.split(found, ends, axis=1)
        self._found = found
        self.terms = terms.reshape(count, n, len(WEIGHTS))
        self._observed = observed.reshape(count, n, width)
        self._perceive = perception_of(self.axes)
        arrays = self._settings, self.commanded, found
        self._rows = [[each[k].ctypes.data for each in arrays] for k in range(count)]
        self._given = [(0,) * 5] * count
        for k in range(count):
            self.enter(k, plant, np.inf)

    def enter(self, mission: int, plant: Plant, bound: float) -> None:
        """Let a mission take place in another world.

        Args:
            mission: Which one, from 0.
            plant: Steps it.
            bound: Distance to the target at which it ends [m].

        Raises:
            UsageError: If sizes are others, if there is no target, or if forces are to be commanded without
                a limit.
        """
        world = plant.world
        if world.sizes != self._sizes:
            raise UsageError(f"missions of one environment have one size: {world.sizes}, not {self._sizes}")
        setup = world.setup
        if setup.target_radius is None and not setup.teams:
            raise UsageError("target: found null; what robots of an environment observe is of a target")
        speed, reward, even = observed_speed(setup.max_speed), self._reward, even_spacings(setup)
        if self._command == "force" and not np.isfinite(setup.force_limit).all():
            raise UsageError("commands of force are shares of robots.force_limit, which is null")
        self.scale[mission, :, 0] = setup.force_limit if self._command == "force" else speed
        avoids = [behavior.avoidance(setup) for behavior in setup.behaviors]
        safe = max((each.safe_distance for each in avoids if each is not None), default=0.0)
        wishes = {
            "speed": speed,
            "safe": safe or 1.0,
            "clearance": reward.clearance if safe else 0.0,
            "sight": float(not any(each.heard_distance for each in setup.avoidance)),
            "spacing": 0.0 if even is None else reward.spacing,
            "bound": SUSPICIOUS * bound,
        }
        for name, value in wishes.items():
            self._settings[mission, SETTINGS.index(name)] = value
        if even is not None:
            self._settings[mission, len(SETTINGS) :] = even.ravel()
        self._found[mission] = 0.0
        settings, commanded, found = self._rows[mission]
        self._given[mission] = (*plant.addresses, settings, commanded, found)

    def perceive(self, mission: int, samples: Array | None = None) -> None:
        """Find what the robots of a mission observe now, and their rewards.

        Args:
            mission: Which one, from 0; the last step that its plant took was one of a sample.
            samples: All that were taken since the last command, shape (k, size); None for that one alone.
        """
        self.clearance[mission] = np.inf
        if samples is not None:
            every = samples[:, columns("clearance", self._sizes)]
            every = every.reshape(len(samples), self.robots, -1)
            self.clearance[mission] = every.min(axis=(0, 2), initial=np.inf)
        self._perceive(*self._given[mission])

    def add_own(self, missions: Sequence[int], samples: Array, broken: NDArray[np.bool_]) -> None:
        """Find what is one's own of missions that have perceived, and add it to their rewards.

        Args:
            missions: Which ones, from 0.
            samples: Their last ones, shape (len(missions), record_size).
            broken: Which of these have ended as they should not, shape (len(missions),).
        """
        those = list(missions)
        self.own.find(those, Now(samples, self._sizes, self.commanded[those]), broken)
        self.rewards[those] += self.own.terms[those].sum(axis=2)

    @property
    def observed(self) -> Array:
        """What each robot observed last, shape (N, n, width); see `Simulation.observe`."""
        return np.concatenate([self._observed, self.own.observed], axis=2) if self.own else self._observed

    def reward_terms(self) -> dict[str, Array]:
        """Return copies of what rewards are sums of, by name, each of shape (N, n)."""
        terms = np.concatenate([each.transpose(2, 0, 1) for each in (self.terms, self.own.terms)])
        return dict(zip([*WEIGHTS, *self.own.names], terms, strict=True))

    def kept(self, mission: int) -> tuple[Array, ...]:
        """Return copies of what is known of a mission since its last command, for `put`."""
        known = self.commanded, self._found, self.own.observed, self.own.terms
        return tuple(each[mission].copy() for each in known)

    def put(self, mission: int, kept: tuple[Array, ...]) -> None:
        """Take up what `kept` returned in a mission that has entered its world."""
        self.commanded[mission], self._found[mission] = kept[:2]
        self.own.observed[mission], self.own.terms[mission] = kept[2:]

    def limits(self, bound: float) -> Seen:
        """Return the largest size of each number that a robot observes, shape (width,).

        Args:
            bound: Distance to the target at which a mission ends [m]; teammates are at most twice as far.
        """
        lengths, speeds = 2.0 * bound / self._least_radius, FASTEST
        parts = [lengths, speeds, speeds, *[lengths] * (1 + self._mates), *[lengths, speeds] * self._opposed]
        return np.append(np.repeat(np.array(parts, dtype=np.float32), self.axes), self.own.limits)

    def bounded(self, limits: Seen) -> Seen:
        """Return observations as learners take them: cut off at `limits`, and 0 where there is no number.

        Args:
            limits: Shape (width,).

        Returns:
            Shape (N, n, width).
        """
        with np.errstate(invalid="ignore"):
            found = np.clip(self.observed, -limits, limits, dtype=np.float32, casting="unsafe")
            if np.isnan(found).any():
                found[np.isnan(found)] = 0.0
            return found


def even_spacings(setup: Setup) -> Array | None:
    """Return the even spacing of each team by its number of robots [m]; None where there is no formation.

    Args:
        setup: Of a mission.

    Returns:
        Shape (teams, n), or (1, n) where all robots are one team, which then has n; infinite where a team has
        nobody to keep a distance to, or never has so many robots.
    """
    spacing, n = setup.edges[1], setup.count
    if not len(spacing):
        return None
    found = np.full((max(len(setup.teams), 1), n), np.inf)
    if not setup.teams:
        found[0, n - 1] = spacing.min()
    for row, team in zip(found, setup.teams, strict=False):
        for robots in range(1, n + 1) if setup.reforming else [len(team.robots)]:
            lengths = nearest_edges(even_points(robots, setup.axes))[1]
            row[robots - 1] = setup.radii_of(team)[0] * lengths.min(initial=np.inf)
    return found
