"""The sensors, from the whole history of the truth and NumPy's own Philox generator."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from escort_mj.sensing.noise_streams import NOISE_KEY, ball_noise

if TYPE_CHECKING:
    from escort_mj.control.setup import Setup

Array = NDArray[np.float64]

DROPOUTS = 2  # what a stream is for: noise of robots, of the target, then whose measurements arrive


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
        for number, channel in enumerate(self.setup.sensing.channels):
            old = np.atleast_2d(self._history[max(len(self._history) - 1 - channel.delay, 0)][number])
            bias = 0.0 if channel.bias is None else channel.bias
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
        pair = self.setup.sensing.channels[2 * use : 2 * use + 2]
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
                    key=np.array([self.setup.seed, NOISE_KEY], dtype=np.uint64),
                    counter=np.array([0, DROPOUTS + use, body, step], dtype=np.uint64),
                )
            )
            chances[body] = generator.random(2)[place]  # the upper 53 bits of each word
        return chances


def in_range(gaps: Array, sensing_radius: float) -> Array:
    """Distances, surface to surface, as a robot knows them: infinite beyond its sensing radius [m]."""
    return np.where(gaps <= sensing_radius, gaps, np.inf)
