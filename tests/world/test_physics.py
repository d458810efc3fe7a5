"""Worlds with known answers: MuJoCo does what mechanics says, and forces and totals are what they claim."""

import numpy as np
import pytest

from tests.corpus import missions

PUSH = 0.7


@pytest.mark.parametrize("axes", [2, 3, 4, 5])
def test_constant_disturbance_accelerates_a_mass(axes: int, drifting, record_steps) -> None:
    """x = x0 + a t^2 / 2; with the semi-implicit Euler steps of MuJoCo a dt^2 k (k + 1) / 2, exactly."""
    start = np.array([1.0, -2.0, 3.0, 7.0, -5.0])[:axes]
    push = np.array([PUSH, -0.3, 1.1, 0.4, -0.5])[:axes]
    world = drifting(
        {"positions": [start.tolist(), (start + 9.0).tolist()], "overrides": [{"robot": 2, "mass": 2.5}]},
        axes=axes,
        uncertainty={"disturbance": push.tolist()},
    )
    record = record_steps(world, 1001)
    k = np.arange(1001)[:, None, None]
    a, dt = push / np.array([[1.0], [2.5]]), 0.002
    np.testing.assert_allclose(record["v"], a * dt * k, rtol=1e-10, atol=1e-12)
    expected = world.team.position + a * dt**2 * k * (k + 1) / 2
    np.testing.assert_allclose(record["q"], expected, rtol=0.0, atol=1e-10)
    np.testing.assert_array_equal(record["disturbance"], np.broadcast_to(push, (1001, 2, axes)))
    np.testing.assert_allclose(record["time"], k[:, 0, 0] * dt, rtol=0.0, atol=1e-12)


def test_disturbance_of_time_is_integrated(drifting, record_steps) -> None:
    """m v is the integral of sin(3 t); each step takes the force at its beginning, which costs dt / 2."""
    world = drifting({"positions": [[0.0, 0.0]]}, uncertainty={"disturbance": ["sin(3*t)", "0"]})
    record = record_steps(world, 1000)
    exact = (1.0 - np.cos(3.0 * record["time"])) / 3.0
    assert np.abs(record["v"][:, 0, 0] - exact).max() < 1.01 * 0.002 / 2
    assert np.abs(record["v"][:, 0, 1]).max() < 1e-11


def test_a_throw_in_gravity(drifting, record_steps) -> None:
    """Height against time is a parabola; energy drifts only by the step's own error, g v dt."""
    world = drifting(
        {"positions": [[0.0, 0.0, 0.0]], "mass": 0.7}, axes=3, physics={"gravity": [0.0, 0.0, -9.81]}
    )
    record = record_steps(world, 1000, lambda plant: plant.data.qvel.__setitem__(2, 8.0))
    k, dt = np.arange(1000), 0.002
    np.testing.assert_allclose(
        record["q"][:, 0, 2], 8.0 * k * dt - 9.81 * dt**2 * k * (k + 1) / 2, rtol=0, atol=1e-9
    )
    energy = 0.7 * (record["v"][:, 0, 2] ** 2 / 2 + 9.81 * record["q"][:, 0, 2])
    t = k * dt
    np.testing.assert_allclose(energy, energy[0] - 0.7 * 9.81**2 * dt * t / 2, rtol=0, atol=1e-9)


def test_momentum_survives_a_collision(drifting, record_steps) -> None:
    """Contact forces are equal and opposite: total momentum stays, relative speed does not grow."""
    world = drifting(
        {
            "positions": [[-1.0, 0.05, 0.0], [1.0, 0.0, 0.0]],
            "overrides": [{"robot": 1, "mass": 3.0}],
        },
        axes=3,
    )
    record = record_steps(
        world, 1200, lambda plant: plant.data.qvel.__setitem__(slice(0, 6), [1, 0, 0, -1, 0, 0])
    )
    mass = np.array([3.0, 1.0])
    momentum = (mass[:, None] * record["v"]).sum(axis=1)
    assert record["clearance"].min() < 0.0
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], momentum.shape), rtol=0, atol=1e-9)
    energy = 0.5 * (mass[:, None] * record["v"] ** 2).sum(axis=(1, 2))
    assert energy[-1] < energy[0]
    assert record["v"][-1, 0, 0] < 1.0 and record["v"][-1, 1, 0] > -1.0


def test_a_rolling_sphere_weighs_seven_fifths(drifting, record_steps) -> None:
    """Pushed at its center, a homogeneous ball that does not slip accelerates at F / (7/5 m)."""
    radius, mass = 0.25, 2.0
    world = drifting(
        {"kind": "rolling_sphere", "positions": [[0.0, 0.0]], "mass": mass, "radius": radius},
        uncertainty={"disturbance": [PUSH, 0.0]},
    )
    spin = []
    record = record_steps(world, 1500, after=lambda plant: spin.append(plant.data.qvel.copy()))
    speed = record["v"][:, 0, 0]
    acceleration = (speed[-1] - speed[500]) / (record["time"][-1] - record["time"][500])
    effective = PUSH / acceleration
    print(f"effective mass / (7/5 m) - 1 = {effective / (1.4 * mass) - 1:.2e}")
    assert effective == pytest.approx(1.4 * mass, rel=2e-3)
    last = spin[-1]  # vx vy vz, then the ball's own angular velocity; it turns about y alone
    assert last[4] * radius == pytest.approx(last[0], rel=2e-2)
    assert np.abs(last[[1, 3, 5]]).max() < 1e-6
    assert abs(record["qpos"][-1, 2] - radius) < 5e-3


def test_the_controller_moves_a_rolling_sphere_by_its_motor(make_world, record_steps) -> None:
    """A saturated motor pushes with the force limit, and 7/5 of the mass resists."""
    world = make_world(
        robots={"kind": "rolling_sphere", "positions": [[50.0, 0.0]], "force_limit": 0.5},
        mission={"radius": 1.0, "behaviors": ["surface"]},
    )
    record = record_steps(world, 1000)
    assert (record["force"][10:, 0, 0] == -0.5).all()
    acceleration = (record["v"][-1, 0, 0] - record["v"][200, 0, 0]) / (799 * 0.002)
    assert acceleration == pytest.approx(-0.5 / 1.4, rel=5e-3)


def mission(timestep: float) -> dict:
    """Three robots that gather around a moving target, without noise."""
    return {
        "physics": {"timestep": timestep},
        "robots": {"positions": [[7.0, 1.0], [-2.0, 6.0], [-3.0, -5.0]], "force_limit": None},
        "mission": {"radius": 3.0, "behaviors": ["chords", "surface"], "max_speed": 2.0},
        "target": {"position": ["0.5*t", "sin(0.5*t)"]},
        "uncertainty": {"disturbance": ["0.5*sin(0.5*t)", "0.5*sin(0.7*t)"]},
        "recording": {"rate": 50},
    }


def test_refining_the_timestep_converges_at_first_order(make_world, record_steps) -> None:
    """Final positions at dt, dt/2, dt/4: differences halve, for semi-implicit Euler."""
    final = []
    for halvings in range(4):
        timestep = 0.004 / 2**halvings
        record = record_steps(make_world(**mission(timestep)), round(2.0 / timestep) + 1)
        assert record["time"][-1] == pytest.approx(2.0)
        final.append(record["q"][-1])
    steps = [np.linalg.norm(a - b) for a, b in zip(final, final[1:], strict=False)]
    orders = [np.log2(a / b) for a, b in zip(steps, steps[1:], strict=False)]
    print(f"differences {steps}, orders {orders}")
    assert steps[0] < 0.05
    assert orders == pytest.approx([1.0, 1.0], abs=0.15)


MISSIONS = missions(__file__)


@pytest.fixture(scope="module")
def busy(make_world, record_steps):
    """A mission with everything going on, recorded at every step, and its world."""
    world = make_world(**MISSIONS["busy"], recording={"rate": 500})
    assert world.schedule.stride == 1
    return world, record_steps(world, 2500)


def test_force_is_the_demand_within_the_limit(busy) -> None:
    world, record = busy
    limit = world.team.force_limit[:, None]
    np.testing.assert_array_equal(record["force"], np.clip(record["tau"], -limit, limit))
    at_limit = np.abs(record["force"]) == limit
    assert at_limit[:, :2].any() and not at_limit.all() and not at_limit[:, 2].any()


def test_totals_are_sums_over_every_step(busy) -> None:
    world, record = busy
    dt, force, limit = 0.002, record["force"], world.team.force_limit[:, None]
    expected = {
        "effort": dt * np.cumsum((force**2).sum(axis=2), axis=0),
        "work": dt * np.cumsum(np.abs((force * record["v"]).sum(axis=2)), axis=0),
        "force_variation": np.cumsum(np.abs(np.diff(force, axis=0, prepend=force[:1])).sum(axis=2), axis=0),
        "saturated_time": dt * np.cumsum((np.abs(record["tau"]) > limit).any(axis=2), axis=0),
    }
    for name, values in expected.items():
        np.testing.assert_allclose(record[name], values, rtol=1e-11, atol=1e-11, err_msg=name)
        assert values[-1].max() > 0.0


def test_distances_are_those_of_the_true_positions(busy) -> None:
    world, record = busy
    q, radius = record["q"], world.team.radius
    to_obstacles = np.linalg.norm(q[:, :, None] - world.setup.obstacle_position, axis=3)
    np.testing.assert_allclose(record["obstacle_distance"], to_obstacles, rtol=1e-13)
    to_target = np.linalg.norm(q - record["target_position"][:, None], axis=2)
    clearance, nearest = record["clearance"], record["clearance_body"]
    gaps = to_obstacles - radius[:, None] - world.setup.obstacle_radius
    np.testing.assert_allclose(clearance[..., 2], gaps.min(axis=2), rtol=0, atol=1e-13)
    np.testing.assert_allclose(clearance[..., 1], to_target - radius - 0.3, rtol=0, atol=1e-13)
    assert np.isinf(clearance[..., 3]).all() and (nearest[..., 3] == -1.0).all(), "there are no walls"
    assert (nearest[..., 1] == 4.0).all()
    np.testing.assert_array_equal(nearest[..., 2], 5.0 + gaps.argmin(axis=2))
    pairs = np.linalg.norm(q[:, :, None] - q[:, None], axis=3)
    pairs[:, np.arange(4), np.arange(4)] = np.inf
    np.testing.assert_allclose(record["robot_distance_min"], pairs.min(axis=2), rtol=1e-13)
    gaps = pairs - radius[:, None] - radius
    np.testing.assert_allclose(clearance[..., 0], gaps.min(axis=2), rtol=0, atol=1e-13)
    np.testing.assert_array_equal(nearest[..., 0], gaps.argmin(axis=2))
    of_target = record["target_clearance"]
    to_rock = np.linalg.norm(record["target_position"] - world.setup.obstacle_position[0], axis=1)
    np.testing.assert_allclose(of_target[:, 0], (to_target - radius - 0.3).min(axis=1), rtol=0, atol=1e-13)
    np.testing.assert_allclose(of_target[:, 2], to_rock - 0.8, rtol=0, atol=1e-13)
    assert (record["target_clearance_body"][:, 2] == 5.0).all() and np.isinf(of_target[:, [1, 3]]).all()


@pytest.mark.slow_cases("0.0")
@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_distances_in_a_crowd_are_those_of_all_pairs(noise: float, make_world, record_steps) -> None:
    """Robots that rush through each other to their places: lists of neighbors miss nobody."""
    team = {"count": 70, "radius": 0.1, "placement": {"within": 4, "least_gap": 0.05}}
    team["overrides"] = [{"robot": 7, "radius": 0.35}]
    world = make_world(
        axes=3,
        robots=team,
        mission={"radius": 1.5, "behaviors": ["avoid_obstacles", "surface"], "outer": "nsb"},
        sensing={"position": {"noise": noise}},
        recording={"rate": 500},
    )
    record = record_steps(world, 700)
    q, radius = record["q"], world.team.radius
    pairs = np.linalg.norm(q[:, :, None] - q[:, None], axis=3)
    pairs[:, np.arange(70), np.arange(70)] = np.inf
    np.testing.assert_allclose(record["robot_distance_min"], pairs.min(axis=2), rtol=1e-12)
    gaps = pairs - radius[:, None] - radius
    np.testing.assert_allclose(record["clearance"][..., 0], gaps.min(axis=2), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(record["clearance_body"][..., 0], gaps.argmin(axis=2))
    changes = (np.diff(gaps.argmin(axis=2), axis=0) != 0).sum()
    assert changes > 200 and record["avoidance_active"].any()


def test_speeds_and_kinetic_energy_are_those_of_every_step(busy) -> None:
    world, record = busy
    speed = np.linalg.norm(record["v"], axis=2)
    np.testing.assert_allclose(record["speed_max"], speed, rtol=1e-13)
    energy = 0.5 * (world.team.mass * speed**2).sum(axis=1)
    np.testing.assert_allclose(record["kinetic_energy"].ravel(), energy, rtol=1e-12)


def test_the_sampled_run_is_the_same_run(busy, make_world, record_steps) -> None:
    """At a tenth of the rate: the same signals, the worst of each ten steps, totals that miss nothing."""
    _, record = busy
    sampled_world = make_world(**MISSIONS["busy"], recording={"rate": 50})
    sampled = {name: values[::10] for name, values in record_steps(sampled_world, 2491).items()}
    for name in sampled:
        if name.endswith("clearance"):
            blocks = record[name][1:2491].reshape(249, 10, -1)
            np.testing.assert_array_equal(
                sampled[name][1:].reshape(249, -1), blocks.min(axis=1), err_msg=name
            )
            who = record[f"{name}_body"][1:2491].reshape(blocks.shape)
            chosen = np.take_along_axis(who, blocks.argmin(axis=1)[:, None], axis=1)[:, 0]
            np.testing.assert_array_equal(sampled[f"{name}_body"][1:].reshape(249, -1), chosen)
        elif name in ("speed_max", "target_speed_max", "obstacle_speed_max", "kinetic_energy"):
            blocks = record[name][1:2491].reshape(249, 10, -1).max(axis=1)
            np.testing.assert_array_equal(sampled[name][1:].reshape(249, -1), blocks, err_msg=name)
        elif not name.endswith("_body"):
            np.testing.assert_array_equal(sampled[name], record[name][:2491:10], err_msg=name)


def test_single_bodies_that_are_expected_have_clearances_of_their_own(make_world, record_steps) -> None:
    """One robot, one obstacle, the target: in columns behind those of the groups."""
    expect = [
        {"clearance": ["robot_1", "robot_2"], "at_least": 0.1},
        {"clearance": ["robots", "rock"], "at_least": 0.1},
    ]
    keys = MISSIONS["busy"] | {
        "obstacles": [*MISSIONS["busy"]["obstacles"], {"position": [0.0, 6.0], "name": "rock"}]
    }
    world = make_world(**keys, recording={"rate": 500}, expect=expect)
    watched = world.bodies.watched
    assert set(watched[4:]) == {"robot_2", "rock"}
    record = record_steps(world, 300)
    q, radius = record["q"], world.team.radius
    to_second = np.linalg.norm(q - q[:, 1:2], axis=2) - radius - radius[1]
    to_second[:, 1] = np.inf
    to_rock = np.linalg.norm(q - [0.0, 6.0], axis=2) - radius - 0.5
    for name, gaps, body in (("robot_2", to_second, 1), ("rock", to_rock, 6)):
        column = watched.index(name)
        np.testing.assert_allclose(record["clearance"][..., column], gaps, rtol=0, atol=1e-13)
        near = np.where(np.isfinite(gaps), body, -1)
        np.testing.assert_array_equal(record["clearance_body"][..., column], near)
    target = record["target_clearance"][:, watched.index("rock")]
    away = np.linalg.norm(record["target_position"] - [0.0, 6.0], axis=1) - 0.8
    np.testing.assert_allclose(target, away, rtol=0, atol=1e-13)
