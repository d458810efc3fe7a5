"""The water around a vessel: against its twin, and what mechanics says of it."""

import numpy as np

from escort_mj.robots import hydrodynamics
from escort_mj.robots.hydrodynamics import Vessel
from escort_mj.robots.surface_vessel import SurfaceVessel
from tests.oracle.hydrodynamics import coriolis_matrix, damping_matrix, immersed

RNG = np.random.default_rng(9)
MODEL_SHIP = SurfaceVessel(length=1.255)  # type: ignore[call-arg]

immerse = hydrodynamics.immerse


def test_the_kernel_is_the_twin() -> None:
    mass, coriolis, damping = np.empty(6), np.empty(3), np.empty(3)
    for _ in range(100):
        vessel, heading = Vessel(*RNG.normal(size=len(Vessel._fields))), RNG.uniform(-9.0, 9.0)
        velocity = RNG.normal(size=3)
        immerse(heading, velocity, np.array(vessel), mass, coriolis, damping)
        matrix, force, drag = immersed(heading, velocity, vessel)
        np.testing.assert_allclose(mass, matrix[np.tril_indices(3)], rtol=0, atol=1e-12)
        np.testing.assert_allclose(coriolis, force, rtol=0, atol=1e-12)
        np.testing.assert_allclose(damping, drag, rtol=0, atol=1e-12)


def test_added_mass_keeps_energy() -> None:
    """Its Coriolis force is M'/2 v and what does no work: M' from two mass matrices, a moment apart."""
    vessel = MODEL_SHIP.vessel(23.8, 1.3)
    bare = vessel._replace(
        surge_mass=vessel.added_surge, sway_mass=vessel.added_sway, coupling=vessel.added_coupling
    )
    for _ in range(20):
        heading, velocity, moment = RNG.uniform(-3.0, 3.0), RNG.normal(size=3), 1e-5
        _, force, _ = immersed(heading, velocity, bare)
        later, before = (
            immersed(heading + sign * moment * velocity[2], velocity, bare)[0] for sign in (1.0, -1.0)
        )
        change = 0.5 * velocity @ (later - before) @ velocity / (2.0 * moment)
        np.testing.assert_allclose(velocity @ force, change, rtol=0, atol=1e-8)


def test_the_model_ship_is_the_one_in_the_literature() -> None:
    """M and D of CyberShip II at midship, from what is packed for the hand point."""
    vessel = MODEL_SHIP.vessel(23.8, 1.3)
    ahead = vessel.ahead
    assert ahead == 0.4 * 1.255
    there = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, ahead], [0.0, 0.0, 1.0]])
    at_hand = np.array(
        [
            [vessel.surge_mass, 0.0, 0.0],
            [0.0, vessel.sway_mass, vessel.coupling],
            [0.0, vessel.coupling, vessel.inertia],
        ]
    )
    found = there.T @ at_hand @ there
    np.testing.assert_allclose(found, [[25.8, 0, 0], [0, 33.8, 1.0948], [0, 1.0948, 2.76]], atol=1e-12)
    damping = damping_matrix(np.array([0.5, 0.0, 0.0]), vessel)
    np.testing.assert_allclose(damping[0, 0], 0.72253 + 1.32742 * 0.5 + 5.86643 * 0.25, rtol=1e-12)
    np.testing.assert_allclose(damping[1:, 1:], [[0.88965, 0.0], [-0.0313, 1.9]], rtol=1e-12)


def test_another_size_moves_likewise() -> None:
    """Froude's law: four times as long and 64 times as heavy, all is as in the model at twice the speed."""
    small, large = MODEL_SHIP.vessel(23.8, 1.3), SurfaceVessel(length=5.02).vessel(64 * 23.8, 5.2)  # type: ignore[call-arg]
    velocity = np.array([0.4, -0.1, 0.2])
    scale = np.array([1.0, 1.0, 4.0])
    mass, force, drag = immersed(0.3, velocity, small)
    found_mass, found_force, found_drag = immersed(0.3, velocity * [2.0, 2.0, 0.5], large)
    np.testing.assert_allclose(found_mass, 64 * mass * np.outer(scale, scale), rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(found_force, 64 * force * scale, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(found_drag, 64 * drag * scale, rtol=1e-12, atol=1e-9)


def test_kirchhoffs_matrix_does_no_work() -> None:
    for _ in range(20):
        nu, root = RNG.normal(size=3), RNG.normal(size=(3, 3))
        mass = root @ root.T
        mass[0, 1:] = mass[1:, 0] = 0.0
        assert abs(nu @ coriolis_matrix(mass, nu) @ nu) < 1e-12
