"""What sensors measure, and what a lidar sees."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.setup import Setup
from escort_mj.numerics.gaussian import LIDAR
from escort_mj.numerics.noise import TAG
from escort_mj.sensing.lidar import FAR
from escort_mj.sensing.measure import DROPOUTS
from escort_mj.sensing.sensors import bias_of
from tests.oracle.noise import ball_noise, normal
from tests.oracle.rays import stretches_inside

Array = NDArray[np.float64]


class Scanner:
    """The lidars of a team, with what they have seen last."""

    def __init__(self) -> None:
        self._points: Array | None = None

    def returns(self, t: float, q: Array, measured: Array, setup: Setup) -> Array:
        """Return the nearest return from each obstacle as each robot knows it, shape (n, m, p) [m].

        Args:
            t: Time [s].
            q: True positions, shape (n, p) [m].
            measured: Measured positions, likewise.
            setup: Gives lidar and obstacles.
        """
        lidar, step = setup.sensing.lidar, round(t / setup.timestep)
        assert lidar is not None
        every = 1 if lidar.rate is None else round(1.0 / (lidar.rate * setup.timestep))
        rays = lidar.directions(setup.axes)
        if self._points is None or step % every == 0:
            self._points = np.full((*q.shape[:1], *setup.obstacle_position.shape), FAR)
            for i, points in enumerate(self._points):
                error = lidar.noise * normal(len(rays), setup.seed, LIDAR, i, step)
                first, last = stretches_inside(q[i], rays, setup)
                met = (first < last) & (last > 0.0) & (first < lidar.range)
                lengths = np.where(met, np.maximum(first, 0.0), np.inf)
                for j in range(lengths.shape[1]):
                    mine = np.flatnonzero(met[:, j] & (np.argmin(lengths, axis=1) == j))
                    if len(mine):
                        found = np.maximum(lengths[mine, j] + error[mine], 0.0)
                        nearest = int(np.argmin(found))
                        points[j] = measured[i] + found[nearest] * rays[mine[nearest]]
        return self._points


class Instruments:
    """All sensors of a team, with what they have seen so far."""

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        self._history: list[tuple[Array, ...]] = []
        self._shown: tuple[Array, ...] = ()

    def read(self, t: float, moved: bool, *truth: Array) -> list[Array]:
        """What the law is given.

        Args:
            t: Time [s].
            moved: Whether time has moved on since the last reading.
            truth: Robots' positions and velocities, shape (n, p), and the target's, shape (p,) [m, m/s].
        """
        if moved:
            self._history.append(truth)
        self._history[-1] = truth
        step = round(t / self.setup.timestep)
        rows = [np.atleast_2d(values) for values in truth]
        points = [*self._points(step, 0, len(rows[0])), *self._points(step, 1, 1)]
        shown = []
        for number, channel in enumerate(self.setup.sensing.plain):
            delay = round(channel.delay / self.setup.timestep)
            old = np.atleast_2d(self._history[max(len(self._history) - 1 - delay, 0)][number])
            bias = bias_of(channel, self.setup.seed, number, len(rows[number]), self.setup.axes)
            bias = 0.0 if bias is None else bias
            value = old + bias + channel.noise * points[number]
            if channel.resolution:
                value = channel.resolution * np.round(value / channel.resolution)
            if len(self._history) > 1 and channel.dropout:
                missed = self._chances(step, number, len(value)) < channel.dropout
                value = np.where(missed[:, None], np.atleast_2d(self._shown[number]), value)
            shown.append(value.reshape(truth[number].shape))
        self._shown = tuple(shown)
        return shown

    def _points(self, step: int, use: int, bodies: int) -> list[Array]:
        """Points from unit balls for the noise of positions and velocities, shape (bodies, p) each.

        A ball of radius 0 draws nothing, so that the other ball's points come first in the stream.
        """
        pair = self.setup.sensing.plain[2 * use : 2 * use + 2]
        drawn = [place for place, channel in enumerate(pair) if channel.noise > 0.0]
        points = np.zeros((2, bodies, self.setup.axes))
        for body in range(bodies if drawn else 0):
            points[drawn, body] = ball_noise(self.setup.seed, body, step, self.setup.axes, len(drawn), use)
        return list(points)

    def _chances(self, step: int, number: int, bodies: int) -> Array:
        """What decides whether each body's measurement of a channel arrives, shape (bodies,)."""
        use, place = divmod(number, 2)
        chances = np.zeros(bodies)
        for body in range(bodies):
            generator = np.random.Generator(
                np.random.Philox(
                    key=np.array([self.setup.seed, TAG], dtype=np.uint64),
                    counter=np.array([0, DROPOUTS + use, body, step], dtype=np.uint64),
                )
            )
            chances[body] = generator.random(2)[place]  # the upper 53 bits of each word
        return chances


def in_range(gaps: Array, sensing_radius: float) -> Array:
    """Distances, surface to surface, as a robot knows them: infinite beyond its sensing radius [m]."""
    return np.where(gaps <= sensing_radius, gaps, np.inf)
