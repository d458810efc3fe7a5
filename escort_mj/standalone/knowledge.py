"""What the controller is given at one time: checked, completed by the scenario, or between two times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from escort_mj.components.setup import FunctionOfTime
from escort_mj.control.setup import Setup
from escort_mj.errors import UsageError
from escort_mj.scenario.arguments import argument_error, numbers, shape_of
from escort_mj.scenario.geometry.obstacle_body import Body
from escort_mj.scenario.geometry.shapes import in_space, nearest_on_shape

Array = NDArray[np.float64]


class Knowledge(NamedTuple):
    """What is known at one time; None where the scenario says it.

    Attributes:
        time: [s].
        q: Positions of the robots, shape (n, p) [m].
        v: Their velocities, shape (n, p) [m/s].
        target: Position [m] and velocity [m/s] of the target, shape (2, p).
        obstacles: Centers of all obstacles, shape (m, p) [m].
        motion: Velocities of their centers, shape (m, p) [m/s].
        points: What each robot, and last the target, sees of each obstacle, shape (n + 1, m, p) [m].
        mass: Mass matrices, shape (n, p, p) [kg].
        bias: Bias forces, shape (n, p) [N].
    """

    time: float
    q: Array
    v: Array
    target: Array | None = None
    obstacles: Array | None = None
    motion: Array | None = None
    points: Array | None = None
    mass: Array | None = None
    bias: Array | None = None

    def since(self, before: Knowledge, share: float) -> Knowledge:
        """Return what was probably known between two times: everything given at both is interpolated.

        Args:
            before: The earlier time.
            share: Of the time between the two that has passed then, from 0 to 1.
        """
        values: list[Any] = [
            new if old is None or new is None else old + share * (new - old)
            for old, new in zip(before, self, strict=True)
        ]
        return Knowledge(*values)


class Surroundings:
    """Target, obstacles and robots' models, as the scenario has them or as they are given instead.

    Args:
        setup: What the controller is given of the mission.
        bodies: Its obstacles.
        paths: Where those that move are to be: number of the obstacle, from 0, and its path.
        masses: Of the robots, shape (n,) [kg].
    """

    def __init__(
        self,
        setup: Setup,
        bodies: Sequence[Body],
        paths: Sequence[tuple[int, FunctionOfTime]],
        masses: Array,
    ) -> None:
        self.setup, self.bodies, self.paths, self.masses = setup, bodies, paths, masses
        self._shaped = [index for index, body in enumerate(bodies) if not body.is_sphere]

    def target(self, given: Any) -> Array | None:
        """Return the target's position and velocity, shape (2, p); None for the scenario's own."""
        if given is None:
            return None
        if self.setup.target_radius is None:
            raise UsageError("target: this mission has none (target: null)")
        shape = (self.setup.axes,)
        pair = isinstance(given, tuple | list) or (isinstance(given, np.ndarray) and given.ndim == 2)
        if not pair or len(given) != 2 or not hasattr(given[0], "__len__"):
            raise argument_error("target", given, "a pair (position, velocity) of the target [m, m/s]")
        position, velocity = given
        place = numbers(position, "position of the target", shape, "coordinates [m]")
        return np.stack([place, numbers(velocity, "velocity of the target", shape, "components [m/s]")])

    def obstacles(self, time: float, given: ArrayLike | None, before: Array | None) -> Array | None:
        """Return the centers of all obstacles, shape (m, p) [m]; None while none has ever moved.

        Args:
            time: [s].
            given: Those of the moving ones, or of all; None for the scenario's own.
            before: What this returned for the time before.
        """
        if given is None and not self.paths and before is None:
            return None
        centers = self.setup.obstacle_position.copy()
        for index, path in self.paths:
            centers[index] = path.position(time)
        if given is not None:
            moving = [index for index, _ in self.paths]
            rows = moving if shape_of(given)[:1] == (len(moving),) else list(range(len(centers)))
            shape = (len(rows), self.setup.axes)
            some = "moving " if rows == moving else ""
            centers[rows] = numbers(given, "obstacles", shape, f"centers of the {some}obstacles [m]")
        return centers

    def motion(
        self, time: float, centers: Array | None, given: bool, before: Knowledge | None
    ) -> Array | None:
        """Return the velocities of all obstacles, shape (m, p) [m/s]; None while none has ever moved.

        Args:
            time: [s].
            centers: Of all obstacles, shape (m, p) [m].
            given: Whether they were given: then their way since the time before counts.
            before: What was known then.
        """
        if centers is None:
            return None
        if given and before is not None and before.obstacles is not None and time > before.time:
            return np.asarray((centers - before.obstacles) / (time - before.time))
        found = np.zeros_like(centers)
        for index, path in self.paths:
            found[index] = path.velocity(time)
        return found

    def points(
        self, time: float, q: Array, target: Array | None, centers: Array | None, given: ArrayLike | None
    ) -> Array | None:
        """Return what each robot, and last the target, sees of each obstacle; None where all are spheres.

        Args:
            time: [s].
            q: Positions of the robots, shape (n, p) [m].
            target: Position and velocity of the target, shape (2, p); None for the scenario's own.
            centers: Of all obstacles, shape (m, p) [m]; None for the scenario's own.
            given: The nearest points that robots see, shape (n, m, p) [m]; None to compute them.
        """
        if not self._shaped:
            if given is not None:
                raise UsageError("points: all obstacles are spheres, whose centers are used; expected none")
            return None
        setup, (m, p) = self.setup, self.setup.obstacle_position.shape
        centers = setup.obstacle_position if centers is None else centers
        found = np.broadcast_to(centers, (setup.count + 1, m, p)).copy()
        eyes = np.vstack([q, setup.target.position(time) if target is None else target[0]])
        for index in self._shaped:
            found[:, index] = self._seen(self.bodies[index], centers[index], eyes)
        if given is not None:
            found[:-1] = numbers(given, "points", (setup.count, m, p), "nearest points of the obstacles [m]")
        return found

    def _seen(self, body: Body, center: Array, eyes: Array) -> Array:
        """The points of a shape that are nearest to robots and target, shape (n + 1, p) [m].

        A robot inside sees the shape behind it, at most by its own radius, as in the physics step.
        """
        place = in_space(center[None])[0] + [0.0, 0.0, body.lift]
        surface, gap = nearest_on_shape(body.solid._replace(center=place), in_space(eyes))
        surface, depth = surface[:, : self.setup.axes], np.maximum(-gap, 1e-300)
        behind = np.minimum(depth, np.append(self.setup.robot_radius, 0.0)) / depth
        return np.where((gap < 0.0)[:, None], eyes - behind[:, None] * (surface - eyes), surface)

    def model(self, mass: ArrayLike | None, bias: ArrayLike | None) -> tuple[Array | None, Array | None]:
        """Return mass matrices and bias forces, nominal where not given; None for laws that use none.

        Args:
            mass: One mass per robot, shape (n,), or mass matrices, shape (n, p, p) [kg].
            bias: Bias forces, shape (n, p) [N].
        """
        needed = any(law.needs_model for law in self.setup.all_laws)
        if mass is None and bias is None and not needed:
            return None, None
        n, p = self.setup.count, self.setup.axes
        given = self.masses if mass is None else mass
        if len(shape_of(given)) == 1:
            matrices = numbers(given, "mass", (n,), "one mass per robot [kg]")[:, None, None] * np.eye(p)
        else:
            matrices = numbers(given, "mass", (n, p, p), "one mass matrix per robot [kg]")
        if mass is not None:
            _require_positive(matrices)
        forces = np.zeros((n, p)) if bias is None else numbers(bias, "bias", (n, p), "bias forces [N]")
        return (matrices, forces) if needed else (None, None)


def _require_positive(matrices: Array) -> None:
    """Refuse mass matrices that no robot has: they are symmetric and positive definite.

    Args:
        matrices: Shape (n, p, p) [kg].
    """
    turned = matrices.swapaxes(1, 2)
    even = np.abs(matrices - turned).max(axis=(1, 2)) <= 1e-9 * np.abs(matrices).max(axis=(1, 2))
    least = np.linalg.eigvalsh(0.5 * (matrices + turned)).min(axis=1)
    for robot in np.flatnonzero(~(even & (least > 0.0))).tolist():
        found = f"{matrices[robot].tolist()} of robot {robot + 1}"
        raise UsageError(f"mass: found {found}; expected masses above 0, or positive definite matrices [kg]")
