"""Every task's Jacobian against finite differences of its task function, and the closed forms of J^+."""

import numpy as np
import pytest

from tests.oracle.task import Function, distance, half_squared_distance, resolve

STEP = 1e-6
TASKS = (half_squared_distance, distance)


def team(axes: int, seed: int, count: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """Positions and the point that each robot's task looks at, both (n, p)."""
    rng = np.random.default_rng(seed)
    return rng.normal(scale=5.0, size=(count, axes)), rng.normal(scale=5.0, size=(count, axes))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("axes", [2, 3, 4])
@pytest.mark.parametrize("task", TASKS)
def test_jacobian_is_the_derivative(task, axes: int, seed: int) -> None:
    q, anchors = team(axes, seed)
    differences = np.empty((len(q), q.size))
    for column in range(q.size):
        step = np.zeros(q.size)
        step[column] = STEP
        ahead, behind = (task(q + sign * step.reshape(q.shape), anchors).value for sign in (1.0, -1.0))
        differences[:, column] = (ahead - behind) / (2.0 * STEP)
    np.testing.assert_allclose(task(q, anchors).jacobian, differences, atol=1e-7)


@pytest.mark.parametrize("axes", [2, 3])
def test_task_follows_its_own_velocity(axes: int) -> None:
    """Along q(s) = q + s J^+ rate the task changes at that rate."""
    q, anchors = team(axes, 7)
    rate = np.arange(1.0, 6.0)
    for task in TASKS:
        velocity, _ = resolve(task(q, anchors).jacobian, rate)
        ahead, behind = (
            task(q + sign * STEP * velocity.reshape(q.shape), anchors).value for sign in (1.0, -1.0)
        )
        np.testing.assert_allclose((ahead - behind) / (2.0 * STEP), rate, rtol=1e-6)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("axes", [2, 3])
def test_pseudoinverse_of_the_escort_tasks_is_the_papers(axes: int, seed: int) -> None:
    """J^+ = blockdiag{x / x^T x} (below eqs. 4 and 5), so velocity and null space come robot by robot."""
    q, anchors = team(axes, seed)
    rate = np.random.default_rng(seed).normal(size=len(q))
    velocity, projector = resolve(half_squared_distance(q, anchors).jacobian, rate)
    blocks = projector.reshape(len(q), axes, len(q), axes)
    for i, x in enumerate(q - anchors):
        np.testing.assert_allclose(velocity[i * axes : (i + 1) * axes], x / (x @ x) * rate[i], rtol=1e-11)
        np.testing.assert_allclose(blocks[i, :, i], np.eye(axes) - np.outer(x, x) / (x @ x), atol=1e-13)
        blocks[i, :, i] = 0.0
    np.testing.assert_allclose(blocks, 0.0, atol=1e-13)


@pytest.mark.parametrize("axes", [2, 3])
def test_pseudoinverse_of_avoidance_is_its_transpose(axes: int) -> None:
    q, anchors = team(axes, 1)
    jacobian = distance(q, anchors).jacobian
    np.testing.assert_allclose(np.linalg.pinv(jacobian), jacobian.T, atol=1e-14)


def test_robot_on_its_anchor() -> None:
    """The escort tasks then ask for nothing and project nothing; avoidance flees along the first axis."""
    q = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    anchors = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 7.0]])
    sigma, jacobian = half_squared_distance(q, anchors)
    velocity, projector = resolve(jacobian, np.ones(2))
    np.testing.assert_array_equal(sigma, [0.0, 0.5])
    np.testing.assert_array_equal(velocity[:3], 0.0)
    np.testing.assert_array_equal(projector[:3, :3], np.eye(3))

    flee: Function = distance(q, anchors)
    np.testing.assert_array_equal(flee.value, [0.0, 1.0])
    np.testing.assert_array_equal(flee.jacobian, [[1, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, -1]])
