"""Vessels in water: against Fossen's equations, and two of them that collide."""

import numpy as np
from scipy.integrate import solve_ivp

from escort_mj.robots.surface_vessel import SurfaceVessel
from escort_mj.world.callback import native_loop
from escort_mj.world.plant import Plant
from tests.oracle.hydrodynamics import to_world

FAR = {"position": [1e3, 1e3]}
MASS, RADIUS, HEADING = 23.8, 1.3, 0.3
# CyberShip II with all coefficients of Skjetne, Smogeli and Fossen (2004), the sway force by yaw included.
MODEL_SHIP = {
    "kind": "surface_vessel",
    "length": 1.255,
    "sway_damping": [0.88965, 36.47287, 0.805, 7.25, 0.845, 3.45],
    "heading": HEADING,
}
SPACING = 0.3 * 1.255


def thrusts(time: float) -> tuple[float, float]:
    return 3.0 + 2.0 * np.sin(0.3 * time), 3.0 + 2.0 * np.cos(0.23 * time)


def rate(time: float, at: np.ndarray) -> np.ndarray:
    """Fossen's equations at midship: of x, y and heading, and of surge, sway and yaw."""
    u, v, r = nu = at[3:]
    mass = np.array([[25.8, 0.0, 0.0], [0.0, 33.8, 23.8 * 0.046], [0.0, 23.8 * 0.046, 2.76]])
    c13, c23 = -(mass[1, 1] * v + mass[1, 2] * r), mass[0, 0] * u
    coriolis = np.array([[0.0, 0.0, c13], [0.0, 0.0, c23], [-c13, -c23, 0.0]])
    au, av, ar = abs(u), abs(v), abs(r)
    damping = np.array(
        [
            [0.72253 + 1.32742 * au + 5.86643 * u * u, 0.0, 0.0],
            [0.0, 0.88965 + 36.47287 * av + 0.805 * ar, 7.25 + 0.845 * av + 3.45 * ar],
            [0.0, -0.0313 - 3.95645 * av - 0.130 * ar, 1.9 - 0.080 * av + 0.75 * ar],
        ]
    )
    left, right = thrusts(time)
    tau = np.array([left + right, 0.0, 0.5 * SPACING * (right - left)])
    return np.concatenate([to_world(at[2]) @ nu, np.linalg.solve(mass, tau - coriolis @ nu - damping @ nu)])


def test_the_response_to_thrusts_is_that_of_fossens_equations(make_world) -> None:
    """Open loop for 60 s, half a dozen turns: within 0.1 % of the way and of the angle."""
    ahead = 0.4 * 1.255
    robots = {
        "kind": MODEL_SHIP, "mass": MASS, "radius": RADIUS,
        "positions": [[0.5, -0.2]], "velocities": [[0.2, 0.05]],
    }  # fmt: skip
    world = make_world("force", robots=robots, target=FAR)
    lever, times, places = SPACING / (2.0 * ahead), [], []
    with native_loop(world):
        plant = Plant(world)
        for _ in range(round(60.0 / world.setup.timestep)):
            left, right = thrusts(plant.data.time)
            heading = plant.data.qpos[2]
            plant.state.tau[0] = (to_world(heading) @ [left + right, lever * (right - left), 0.0])[:2]
            plant.step(1)
            times.append(plant.data.time)
            places.append(plant.data.qpos.copy())
    c, s = np.cos(HEADING), np.sin(HEADING)
    turn = (c * 0.05 - s * 0.2) / ahead
    start = [0.5 - ahead * c, -0.2 - ahead * s, HEADING, c * 0.2 + s * 0.05, 0.0, turn]
    exact = solve_ivp(rate, (0.0, times[-1]), start, t_eval=times, rtol=1e-9, atol=1e-11).y.T
    hand = exact[:, :2] + ahead * np.column_stack([np.cos(exact[:, 2]), np.sin(exact[:, 2])])
    way = np.linalg.norm(np.diff(hand, axis=0), axis=1).sum()
    off = np.linalg.norm(np.array(places)[:, :2] - hand, axis=1).max()
    angle = np.abs(np.array(places)[:, 2] - exact[:, 2]).max()
    print(f"{off:.2e} m of {way:.1f} m, {angle:.2e} rad of {np.ptp(exact[:, 2]):.1f} rad")
    assert way > 20.0 and np.ptp(exact[:, 2]) > 10.0
    assert off < 1e-3 * way and angle < 1e-3 * np.ptp(exact[:, 2])


def test_water_takes_part_in_a_collision(make_world) -> None:
    """Without damping, two vessels that meet keep the momentum of vessels and water, and gain no energy."""
    still = {"surge_damping": [0.0] * 3, "sway_damping": [0.0] * 6, "yaw_damping": [0.0] * 6}
    sizes = {"kind": "surface_vessel", "added_mass": [5.0, 20.0, 3.0, 1.0], **still}
    robots = {
        "kind": sizes, "mass": 20.0, "radius": 1.0,
        "positions": [[0.0, 0.0], [3.0, 0.4]], "velocities": [[1.0, 0.1], [-0.5, 0.0]],
        "overrides": [{"robot": 2, "kind": {**sizes, "heading": 2.0}}],
    }  # fmt: skip
    world = make_world("force", robots=robots, target=FAR, physics={"timestep": 0.0005})
    assert isinstance(world.team.kind[0], SurfaceVessel)
    kept, touching = [], 0
    with native_loop(world):
        plant = Plant(world)
        for _ in range(4000):
            plant.step(1)
            kept.append(_momentum_and_energy(plant))
            touching += plant.data.ncon > 0
    kept = np.array(kept)
    print(f"{touching} steps in touch; momentum {kept[0, :3]} to {kept[-1, :3]}, energy {kept[:, 3]}")
    assert touching > 10 and np.abs(kept[-1, 3] / kept[0, 3] - 1.0) > 0.01
    np.testing.assert_allclose(kept[:, :3] - kept[0, :3], 0.0, atol=1e-2 * np.abs(kept[0, 0]))
    assert kept[-1, 3] < 1.001 * kept[0, 3]


def _momentum_and_energy(plant: Plant) -> np.ndarray:
    """Momentum along x and y, angular momentum about the origin, and kinetic energy of vessels and water."""
    total = np.zeros(4)
    for i, kind in enumerate(plant.world.team.kind):
        own = kind.vessel(20.0, 1.0)
        assert own is not None
        x, y, heading = plant.data.qpos[3 * i : 3 * i + 3]
        velocity, world = plant.data.qvel[3 * i : 3 * i + 3], to_world(heading)
        body = np.array(
            [
                [own.surge_mass, 0.0, 0.0],
                [0.0, own.sway_mass, own.coupling],
                [0.0, own.coupling, own.inertia],
            ]
        )
        momentum = world @ body @ world.T @ velocity
        turning = momentum[2] + x * momentum[1] - y * momentum[0]
        total += [momentum[0], momentum[1], turning, 0.5 * velocity @ momentum]
    return total
