"""Robot kinds whose motion has a known answer: a swinging payload, a wobbling ball, a hovering quadrotor."""

from itertools import pairwise

import mujoco
import numpy as np
import pytest

from escort_mj.world.callback import native_loop
from escort_mj.world.plant import Plant

G = 9.81
SOFT = {"law": "apd_smc", "proportional_gain": 12, "derivative_gain": 12, "adaptation_rate": 6, "slope": 10}
SLUNG = {"kind": "slung", "payload": 0.6, "cable": 0.9, "damping": 0.0, "payload_radius": 0.05}


def frequency(angle: np.ndarray, time: np.ndarray) -> float:
    """Angular frequency of an oscillation about zero, from its first and last upward crossing [rad/s]."""
    up = np.flatnonzero((angle[:-1] < 0.0) & (angle[1:] >= 0.0))
    crossings = time[up] - angle[up] * (time[up + 1] - time[up]) / (angle[up + 1] - angle[up])
    return float(2.0 * np.pi * (len(crossings) - 1) / (crossings[-1] - crossings[0]))


def test_a_payload_swings_below_a_free_cart(drifting, record_steps) -> None:
    """The frequency is sqrt(g / l (1 + m_p / m)) of a point, a little less for a ball of its own inertia."""
    mass, payload, cable, radius = 1.5, SLUNG["payload"], SLUNG["cable"], SLUNG["payload_radius"]
    world = drifting({"kind": SLUNG, "positions": [[0.0, 0.0]], "mass": mass})
    record = record_steps(world, 6000, lambda plant: plant.data.qpos.__setitem__(3, 0.02))
    found = frequency(record["qpos"][:, 3], record["time"])
    inertia = payload * (cable**2 + 0.4 * radius**2)
    stiffness = payload * G * cable * (mass + payload)
    exact = np.sqrt(stiffness / ((mass + payload) * inertia - (payload * cable) ** 2))
    print(f"{found:.5f} rad/s; of a rigid ball {exact:.5f}")
    assert found == pytest.approx(exact, rel=1e-4)
    assert found == pytest.approx(np.sqrt(G / cable * (1.0 + payload / mass)), rel=2e-3)
    moved = record["q"][:, 0, 0] * mass + payload * (
        record["q"][:, 0, 0] - cable * np.sin(record["qpos"][:, 3])
    )
    np.testing.assert_allclose(moved - moved[0], 0.0, atol=1e-4)  # nothing pushes: the common center stays


def test_a_payload_keeps_its_energy_without_damping_and_loses_it_with(drifting, record_steps) -> None:
    kept = []
    for damping in (0.0, 0.05):
        kind = {**SLUNG, "damping": damping}
        world = drifting({"kind": kind, "positions": [[0.0, 0.0, 0.0]], "force_limit": 100.0}, axes=3)
        world.model.opt.gravity[:] = 0.0
        energies = []

        def note(plant: Plant, energies: list = energies) -> None:
            mujoco.mj_energyVel(plant.world.model, plant.data)
            energies.append(plant.data.energy[1])

        with native_loop(world):
            plant = Plant(world)
            plant.data.qvel[3:5] = [2.0, 1.0]
            mujoco.set_mjcb_control(None)  # no motors: what is left is mechanics
            for _ in range(2000):
                mujoco.mj_step(world.model, plant.data)
                note(plant)
        kept.append(energies[-1] / energies[0])
    print("kinetic energy kept", kept)
    assert kept[0] == pytest.approx(1.0, abs=2e-2)
    assert kept[1] < 0.9


@pytest.mark.parametrize("axes", [2, 3])
def test_the_mass_matrix_of_a_slung_robot(axes: int, drifting) -> None:
    """Symmetric and positive; what resists at the hull is between its own mass and both, and turns."""
    mass, payload = 1.5, SLUNG["payload"]
    world = drifting({"kind": SLUNG, "positions": [[0.0] * axes], "mass": mass}, axes=axes)
    data, rng, seen = mujoco.MjData(world.model), np.random.default_rng(1), []
    for _ in range(50):
        data.qpos[axes:] = rng.uniform(-1.2, 1.2, 2)
        mujoco.mj_forward(world.model, data)
        full = np.zeros((world.model.nv, world.model.nv))
        mujoco.mj_fullM(world.model, data, full)
        np.testing.assert_allclose(full, full.T, rtol=0, atol=1e-14)
        assert np.linalg.eigvalsh(full).min() > 0.0
        own, cross, swing = full[:axes, :axes], full[:axes, axes:], full[axes:, axes:]
        effective = np.linalg.eigvalsh(own - cross @ np.linalg.solve(swing, cross.T))
        assert mass - 1e-9 <= effective.min() and effective.max() <= mass + payload + 1e-9
        seen.append(full[0, axes:])
    assert np.ptp(seen, axis=0).max() > 0.1
    np.testing.assert_allclose(own, (mass + payload) * np.eye(axes), atol=1e-12)


def test_a_loaded_ball_wobbles(drifting, record_steps) -> None:
    """About its lowest point as a pendulum that rolls: all inertia counts about the point of contact."""
    mass, load, offset, radius = 1.0, 0.5, 0.12, 0.25
    kind = {"kind": "loaded", "load": load, "offset": offset}
    world = drifting({"kind": kind, "positions": [[0.0, 0.0]], "mass": mass, "radius": radius})
    start = np.array([np.cos(0.05), 0.0, np.sin(0.05), 0.0])  # turned by 0.1 rad about y
    record = record_steps(world, 6000, lambda plant: plant.data.qpos.__setitem__(slice(3, 7), start))
    size = world.model.geom("robot_1_load").size[0]
    inertia = 1.4 * mass * radius**2 + load * ((radius - offset) ** 2 + 0.4 * size**2)
    exact = np.sqrt(load * G * offset / inertia)
    angle = 2.0 * np.arctan2(record["qpos"][:, 5], record["qpos"][:, 3])
    found = frequency(angle, record["time"])
    print(f"{found:.4f} rad/s; without slip {exact:.4f}")
    assert found == pytest.approx(exact, rel=1e-2)
    peaks = [np.abs(block).max() for block in np.array_split(angle, 6)]
    assert all(later <= earlier * 1.001 for earlier, later in pairwise(peaks)), "it gains no energy"
    assert np.ptp(record["q"][:, 0, 0]) == pytest.approx(2 * 0.1 * radius, rel=0.1), "it rolls to and fro"


def tilt(qpos: np.ndarray) -> np.ndarray:
    """Angle of a body's z axis from the vertical, of coordinates shape (k, 7) [rad]."""
    x, y = qpos[:, 4], qpos[:, 5]
    return np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0))


@pytest.mark.parametrize("lag", [0.0, 0.03])
def test_a_quadrotor_hovers(lag: float, drifting, record_steps) -> None:
    """Nothing is asked of it: each rotor carries a quarter of its weight from the start, and it stays."""
    world = drifting(
        {"kind": "quadrotor", "positions": [[1.0, 2.0, 3.0]], "mass": 1.3, "actuators": {"lag": lag}}, axes=3
    )
    thrusts = []
    record = record_steps(
        world, 1000, after=lambda plant: thrusts.append(plant.data.actuator_force[:4].copy())
    )
    np.testing.assert_allclose(thrusts, np.full((1000, 4), 1.3 * G / 4), rtol=1e-9)
    np.testing.assert_allclose(record["q"][:, 0], np.tile([1.0, 2.0, 3.0], (1000, 1)), rtol=0, atol=1e-9)
    assert np.abs(record["force"]).max() < 1e-9


def test_a_quadrotor_answers_a_step_of_force(drifting, record_steps) -> None:
    """Its thrust turns to the force: tilted by F / m g it accelerates by F / m, and overshoots little."""
    mass, force = 1.3, 3.0
    world = drifting(
        {"kind": "quadrotor", "positions": [[0.0, 0.0, 0.0]], "mass": mass, "force_limit": force},
        axes=3,
        target={"position": [1e4, 0.0, 0.0]},
        controller=SOFT,
    )
    record = record_steps(world, 1000)
    leaning = np.arctan(force / (mass * G))
    angle = tilt(record["qpos"])
    print(f"tilt {angle[-1]:.5f} of {leaning:.5f}, at most {angle.max():.5f} rad")
    assert angle[-1] == pytest.approx(leaning, rel=1e-3)
    assert leaning < angle.max() < 1.05 * leaning
    np.testing.assert_allclose(record["force"][-100:, 0], np.tile([force, 0, 0], (100, 1)), atol=2e-2)
    gained = record["v"][-1, 0, 0] - record["v"][-501, 0, 0]
    assert gained == pytest.approx(force / mass * 1.0, rel=1e-3)
    half = record["time"][np.argmax(angle > leaning / 2)]
    assert 0.02 < half < 0.2, "it is late by about a period of its attitude loop, and no more"


def test_a_quadrotor_stays_upright_whatever_is_asked(make_world, record_steps) -> None:
    """Forces far beyond what it has, changing sign: its tilt stays near the limit, rotors within theirs."""
    world = make_world(
        axes=3,
        robots={"kind": "quadrotor", "positions": [[4.0, 0.0, 0.0]], "force_limit": 200.0},
        target={"position": ["6*sin(3*t)", "6*cos(2*t)", "4*sin(5*t)"]},
        mission={"radius": 1.0, "behaviors": ["surface"]},
    )
    thrusts = []
    record = record_steps(
        world, 3000, after=lambda plant: thrusts.append(plant.data.actuator_force[:4].copy())
    )
    most = world.model.actuator_forcerange[0, 1]
    angle = tilt(record["qpos"])
    print(f"tilt up to {angle.max():.3f} rad, thrust up to {np.max(thrusts) / most:.3f} of the limit")
    assert angle.max() < 1.2
    assert np.min(thrusts) >= 0.0 and np.max(thrusts) <= most
    assert np.isfinite(record["q"]).all()


def test_a_planar_quadrotor_holds_its_height(drifting, record_steps) -> None:
    """With 0.1 kg more than its nominal mass it sinks until the height's stiffness carries that."""
    kind = {"kind": "quadrotor", "nominal_mass": 1.0, "height_frequency": 4.0}
    world = drifting({"kind": kind, "positions": [[0.0, 0.0]], "mass": 1.1})
    record = record_steps(world, 4000)
    sunk = world.team.height - record["qpos"][-1, 2]
    assert sunk == pytest.approx(0.1 * G / (1.0 * 4.0**2), rel=1e-3)
    assert np.abs(record["q"][:, 0]).max() < 1e-9


def test_robots_start_with_their_velocities(drifting, record_steps) -> None:
    """Masses glide, and balls roll without a moment of slip."""
    world = drifting({"positions": [[0, 0], [5, 0]], "velocities": [[1, 2], [-0.5, 0]]})
    record = record_steps(world, 100)
    np.testing.assert_allclose(record["v"], np.tile([[1.0, 2.0], [-0.5, 0.0]], (100, 1, 1)), atol=1e-10)
    world = drifting({"kind": "rolling_sphere", "positions": [[0, 0]], "velocities": [[0.6, -0.8]]})
    record = record_steps(world, 500)
    np.testing.assert_allclose(record["v"][:, 0], np.tile([0.6, -0.8], (500, 1)), rtol=0, atol=6e-3)


@pytest.mark.parametrize("kind", ["slung", "quadrotor", "loaded"])
def test_the_truth_of_each_kind(kind: str, make_world, record_steps) -> None:
    """C from M agrees with MuJoCo's bias, dM/dt - 2 C is skew, and forces with accelerations add up."""
    axes = 2 if kind == "loaded" else 3
    world = make_world(
        axes=axes,
        robots={
            "kind": kind,
            "positions": [[3.0, 1.0, 0.0][:axes], [-3.0, 0.0, 1.0][:axes]],
            "force_limit": 30.0,
        },
        mission={"radius": 2.0, "behaviors": ["surface"], "max_speed": 2.0},
        target={"position": ["0.5*t", "sin(t)", 0][:axes]},
        controller=SOFT,
        recording={"truth": True, "rate": 500},
    )
    record = record_steps(world, 600)
    assert record["skew_residual"].max() < 1e-4
    assert record["coriolis_residual"].max() < 1e-4
    coupling = record["mass_coupling"]
    assert (np.ptp(coupling) > 1e-3) == (kind != "quadrotor"), "what is hidden turns, and M with it"
    if kind == "quadrotor":
        assert np.abs(record["bias_force"]).max() < 1e-9, "its weight is held, and nothing else is there"
        np.testing.assert_allclose(record["external_force"], 0.0, atol=1e-9)


@pytest.mark.parametrize("failure", ["dead", "stuck"])
def test_a_quadrotor_whose_motors_fail(failure: str, drifting, record_steps) -> None:
    """Without thrust it falls by g t^2 / 2; with the thrusts of that moment it stays where it hovered."""
    world = drifting(
        {
            "kind": "quadrotor",
            "positions": [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]],
            "failures": [{"robot": 1, "at": 0.2, "kind": failure}],
        },
        axes=3,
    )
    height = record_steps(world, 601)["q"][:, :, 2]
    fallen = 0.5 * G * 0.002**2 * 500 * 501 if failure == "dead" else 0.0
    assert height[600, 0] == pytest.approx(-fallen, abs=1e-9)
    np.testing.assert_allclose(height[:, 1], 0.0, atol=1e-9)


@pytest.mark.parametrize("collides", [False, True])
def test_a_payload_touches_only_if_asked(collides: bool, drifting, record_steps) -> None:
    """Let go from one side it swings up to an obstacle on the other, of which the hull stays clear."""
    kind = {**SLUNG, "payload_collides": collides, "payload_radius": 0.1}
    world = drifting(
        {"kind": kind, "positions": [[0.0, 0.0]], "mass": 50.0},
        obstacles=[{"position": [1.2, 0.0], "radius": 0.5}],
    )
    touches = []
    record_steps(
        world,
        800,
        lambda plant: plant.data.qpos.__setitem__(3, 1.2),
        lambda plant: touches.append(plant.data.ncon),
    )
    assert (max(touches) > 0) == collides


@pytest.mark.parametrize("lag", [0.0, 0.03])
def test_a_quadrotor_is_pushed_where_its_rotors_are(lag: float, make_world, record_steps) -> None:
    """What its motors do together is what thrusts and reactions at the rotors' places do to a rigid body."""
    world = make_world(
        axes=3,
        robots={
            "kind": "quadrotor",
            "positions": [[4.0, 0.0, 0.0], [-4.0, 0.0, 1.0]],
            "actuators": {"lag": lag, "gain_error": 0.2},
        },
        target={"position": ["3*sin(2*t)", "3*cos(2*t)", "sin(3*t)"]},
        mission={"radius": 2.0, "behaviors": ["surface"]},
    )
    model = world.model
    discs = [[model.geom(f"robot_{i}_rotor_{number}").id for number in (1, 2, 3, 4)] for i in (1, 2)]
    tilts = []

    def compare(plant) -> None:
        data, expected = plant.data, np.zeros(model.nv)
        mujoco.mj_forward(model, data)
        for body, rotors in enumerate(discs):
            orientation = data.body(f"robot_{body + 1}").xmat.reshape(3, 3)
            tilts.append(orientation[2, 2])
            for number, geom in enumerate(rotors):
                thrust = data.actuator_force[model.actuator(f"robot_{body + 1}_rotor_{number + 1}").id]
                push, reaction = (
                    thrust * orientation[:, 2],
                    (-1) ** number * 0.016 * thrust * orientation[:, 2],
                )
                mujoco.mj_applyFT(
                    model, data, push, reaction, data.geom_xpos[geom], model.geom_bodyid[geom], expected
                )
        np.testing.assert_allclose(data.qfrc_actuator, expected, rtol=0, atol=1e-12 * 20.0)

    record_steps(world, 300, after=compare)
    assert min(tilts) < 0.95, "they lean, or the test would not see which way thrust goes"
