"""What a scenario becomes in MuJoCo: names, numbers, cameras, collisions, and the exported model."""

import itertools
import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from escort_mj.errors import MujocoError
from escort_mj.memory.packing import pack
from escort_mj.memory.sampling import Sampling
from escort_mj.mjcf import section
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.world.callback import native_loop
from escort_mj.world.loop.addresses import behind, geom_bodies, thickness, unpack_addresses
from escort_mj.world.model.build import World, build
from escort_mj.world.plant import Plant
from tests.corpus import missions

MISSIONS = missions(__file__)
PLANAR, SPATIAL, ROLLING = (MISSIONS[name] for name in ("planar", "spatial", "rolling"))


def each(*names: str) -> pytest.MarkDecorator:
    """For missions of these names."""
    return pytest.mark.parametrize("keys", [MISSIONS[name] for name in names], ids=names)


def world_of(keys: dict) -> World:
    return build(Scenario.model_validate(keys))


def name_of(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    return mujoco.mj_id2name(model, kind, index)


@each("planar", "spatial")
def test_names_and_counts(keys: dict) -> None:
    scenario = Scenario.model_validate(keys)
    world = build(scenario)
    m, p, n = world.model, scenario.axes, len(keys["robots"]["positions"])
    axes = "xyz"[:p]
    assert (m.nq, m.nv, m.nu) == (n * p, n * p, n * p)
    of_record = {
        "robot": n,
        "axis": p,
        "obstacle": len(scenario.obstacles),
        "behavior": 3,
        "coordinate": n * p,
        "group": 4,
    }
    assert world.sizes == of_record
    bodies = [name_of(m, mujoco.mjtObj.mjOBJ_BODY, i) for i in range(1, m.nbody)]
    obstacles = [body.name for body in world.mission.obstacles]
    assert bodies == [f"robot_{i + 1}" for i in range(n)] + obstacles + ["target"]
    joints = [name_of(m, mujoco.mjtObj.mjOBJ_JOINT, i) for i in range(m.njnt)]
    motors = [name_of(m, mujoco.mjtObj.mjOBJ_ACTUATOR, i) for i in range(m.nu)]
    assert joints == motors == [f"robot_{i + 1}_{axis}" for i in range(n) for axis in axes]
    assert m.actuator_trnid[:, 0].tolist() == list(range(n * p))
    cameras = {name_of(m, mujoco.mjtObj.mjOBJ_CAMERA, i) for i in range(m.ncam)}
    assert cameras == {"overview", "top", "target_follow"}


@each("planar", "spatial")
def test_numbers_of_the_scenario(keys: dict) -> None:
    scenario = Scenario.model_validate(keys)
    world = build(scenario)
    m, n, p = world.model, world.sizes["robot"], scenario.axes
    for i in range(n):
        body = m.body(f"robot_{i + 1}")
        assert body.mass[0] == scenario.robots.mass
        assert m.geom(f"robot_{i + 1}_body").size[0] == scenario.robots.radius
    assert m.geom("target_body").size[0] == scenario.target.radius
    for body, obstacle in zip(world.mission.obstacles, scenario.obstacles, strict=True):
        assert m.geom(f"{body.name}_body").size[0] == (obstacle.radius or 0.5)
        assert m.body(body.name).pos[:p].tolist() == list(obstacle.position)
    limit = scenario.robots.force_limit
    assert np.array_equal(m.actuator_forcerange, np.tile([-limit, limit], (n * p, 1)))
    assert m.actuator_forcelimited.all() and not m.actuator_ctrllimited.any()
    assert m.opt.timestep == scenario.physics.timestep
    assert m.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET
    assert m.opt.gravity.tolist() == [0.0, 0.0, 0.0]
    assert np.array_equal(m.actuator_gear, np.tile([1.0, 0, 0, 0, 0, 0], (n * p, 1)))


@each("planar", "spatial")
def test_positions_in_the_world_are_the_coordinates(keys: dict) -> None:
    """`ref` makes qpos the world's position, at the start and anywhere else."""
    world = world_of(keys)
    m, p = world.model, world.sizes["axis"]
    data = mujoco.MjData(m)
    start = np.array(keys["robots"]["positions"], dtype=float)
    assert np.array_equal(data.qpos.reshape(-1, p), start)
    rng = np.random.default_rng(1)
    for qpos in (start.ravel(), rng.normal(scale=20.0, size=m.nq)):
        data.qpos = qpos
        mujoco.mj_kinematics(m, data)
        found = np.array([data.body(f"robot_{i + 1}").xpos[:p] for i in range(len(start))])
        np.testing.assert_allclose(found.ravel(), qpos, rtol=0.0, atol=1e-14)
    height = world.team.radius[0] if p == 2 else 0.0
    assert data.body("target").xpos.tolist() == ([1.0, 2.0, height] if p == 2 else [0.0, 0.0, 0.0])


def test_overrides_reach_mujoco() -> None:
    overrides = [
        {"robot": 1, "mass": 2.5},
        {"robot": 2, "radius": 0.6},
        {"robot": 3, "force_limit": 33.0, "position": [1.25, -7.5]},
    ]
    world = world_of({**PLANAR, "robots": {**PLANAR["robots"], "overrides": overrides}})
    m = world.model
    assert [m.body(f"robot_{i}").mass[0] for i in (1, 2, 3)] == [2.5, 1.5, 1.5]
    assert [m.geom(f"robot_{i}_body").size[0] for i in (1, 2, 3)] == [0.25, 0.6, 0.25]
    assert m.actuator_forcerange[:, 1].tolist() == [7.0, 7.0, 7.0, 7.0, 33.0, 33.0]
    assert m.qpos0[4:].tolist() == [1.25, -7.5]
    assert world.setup.force_limit.tolist() == [7.0, 7.0, 33.0]
    assert world.setup.robot_radius.tolist() == [0.25, 0.6, 0.25]


def test_no_limit_is_no_limit() -> None:
    world = world_of({**PLANAR, "robots": {**PLANAR["robots"], "force_limit": None}})
    assert not world.model.actuator_forcelimited.any()


def test_physics_options() -> None:
    physics = {"timestep": 0.004, "integrator": "implicitfast", "solver": "cg", "gravity": [0.1, 0.2, -0.3]}
    option = world_of({**SPATIAL, "physics": physics}).model.opt
    assert option.timestep == 0.004 and option.gravity.tolist() == [0.1, 0.2, -0.3]
    assert option.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert option.solver == mujoco.mjtSolver.mjSOL_CG
    weightless = world_of({**ROLLING, "physics": {"gravity": [0, 0, 0]}}).model.opt
    assert weightless.gravity.tolist() == [0.0, 0.0, 0.0]


def test_rolling_spheres() -> None:
    world = world_of(ROLLING)
    m = world.model
    assert (m.nq, m.nv, m.nu) == (21, 18, 6)
    assert m.opt.gravity.tolist() == [0.0, 0.0, -9.81]
    assert [m.jnt_type[j] for j in range(3)] == [mujoco.mjtJoint.mjJNT_FREE] * 3
    addresses = unpack_addresses(behind(m.numeric_data.ctypes.data), 2)
    assert addresses.qpos_address.tolist() == [0.0, 7.0, 14.0]
    assert addresses.dof_address.tolist() == [0.0, 6.0, 12.0]
    data = mujoco.MjData(m)
    mujoco.mj_forward(m, data)
    assert data.ncon == 3 and np.allclose(data.contact.dist, 0.0, atol=1e-12)
    assert data.body("robot_2").xpos.tolist() == [-3.0, 1.0, 0.5]
    for i in range(2):
        assert m.actuator_gear[i].tolist() == [float(i == 0), float(i == 1), 0, 0, 0, 0]


def test_bodies_of_the_contact_watch() -> None:
    world = world_of(PLANAR)
    m = world.model
    addresses = unpack_addresses(behind(m.numeric_data.ctypes.data), 2)
    bodies = {name_of(m, mujoco.mjtObj.mjOBJ_GEOM, i): int(b) for i, b in enumerate(addresses.geom_body)}
    assert bodies == {
        "robot_1_body": 0,
        "robot_2_body": 1,
        "robot_3_body": 2,
        "target_body": 3,
        "obstacle_1_body": 4,
        "rock_body": 5,
        "floor": 6,
    }
    names = ("robot_1", "robot_2", "robot_3", "target", "obstacle_1", "rock", "floor")
    assert world.bodies.names == names
    assert world.bodies.groups == (*["robots"] * 3, "target", *["obstacles"] * 2, "floor")
    np.testing.assert_allclose(world.thickness, [0.5, 0.5, 0.5, 0.8, 1.5, 1.0, np.inf])


def test_all_that_hangs_on_a_body_belongs_to_it() -> None:
    """And what hangs on the world under another name belongs to nobody."""
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/><geom name="rail" size=".1"/>
        <body name="robot_1"><geom size=".2"/><freejoint/>
          <body name="load"><geom name="hook" type="box" size=".1 .2 .03"/><joint/></body></body>
        <body name="robot_1_shadow_1"><geom size=".3"/></body></worldbody></mujoco>"""
    )
    names = ("robot_1", "floor")
    assert geom_bodies(model, names).tolist() == [1, -1, 0, 0, -1]
    np.testing.assert_allclose(thickness(model, names), [0.06, np.inf])


@each("planar", "spatial", "rolling")
def test_what_collides_with_what(keys: dict) -> None:
    """Robots with robots, obstacles and the target; point masses not with the floor."""
    m = world_of(keys).model
    rolls = keys["robots"].get("kind") == "rolling_sphere"

    def collide(a: int, b: int) -> bool:
        kinds, meets = m.geom_contype, m.geom_conaffinity
        return bool(kinds[a] & meets[b] or kinds[b] & meets[a])

    names = [name_of(m, mujoco.mjtObj.mjOBJ_GEOM, i) for i in range(m.ngeom)]
    for a, b in itertools.combinations(range(m.ngeom), 2):
        pair = {names[a], names[b]}
        if not any(name.startswith("robot_") for name in pair):
            continue
        assert collide(a, b) == (rolls if "floor" in pair else True), pair


def seen(model: mujoco.MjModel, data: mujoco.MjData, camera: str, point: np.ndarray, aspect: float) -> float:
    """How far from the picture's middle a point appears, its edge at 1; inf behind the camera."""
    index = model.camera(camera).id
    right, up, back = data.cam_xmat[index].reshape(3, 3).T
    x = np.asarray(point) - data.cam_xpos[index]
    depth = -float(x @ back)
    if depth <= 0.0:
        return math.inf
    half = depth * math.tan(math.radians(model.cam_fovy[index]) / 2)
    return max(abs(float(x @ right)) / (half * aspect), abs(float(x @ up)) / half)


@pytest.mark.crossed
@each("planar", "spatial", "rolling", "large")
@pytest.mark.parametrize("camera", ["overview", "top"])
@pytest.mark.parametrize(("width", "height"), [(1280, 720), (720, 1280), (640, 640), (1920, 480)])
def test_cameras_frame_the_mission(keys: dict, camera: str, width: int, height: int) -> None:
    scenario = Scenario.model_validate({**keys, "video": {"width": width, "height": height}, "duration": 12})
    world = build(scenario)
    data = mujoco.MjData(world.model)
    mujoco.mj_forward(world.model, data)
    spheres = [
        (np.array(data.geom_xpos[i]), world.model.geom_rbound[i])
        for i in range(world.model.ngeom)
        if world.model.geom_type[i] == mujoco.mjtGeom.mjGEOM_SPHERE
    ]
    # The escort sphere around the target, on all its way; in the plane it is a circle.
    height_of = data.body("target").xpos[2]
    for t in np.linspace(0.0, scenario.duration, 25):
        center = world.setup.target.position(t)
        if scenario.axes == 2:
            for angle in np.linspace(0.0, 2 * np.pi, 16):
                out = scenario.mission.radius * np.array([math.cos(angle), math.sin(angle)])
                spheres.append((np.array([*(center + out), height_of]), scenario.robots.radius))
        else:
            spheres.append((center, scenario.mission.radius + scenario.robots.radius))
    sides = np.array([*itertools.product([-1.0, 0.0, 1.0], repeat=3)])
    sides = np.unique(sides[1:] / np.maximum(np.linalg.norm(sides[1:], axis=1, keepdims=True), 1.0), axis=0)
    worst = max(
        seen(world.model, data, camera, center + radius * side, width / height)
        for center, radius in spheres
        for side in sides
    )
    assert 0.5 < worst <= 1.0


@each("planar", "spatial")
def test_the_following_camera_keeps_the_circle_in_view(keys: dict) -> None:
    world = world_of(keys)
    data = mujoco.MjData(world.model)
    data.mocap_pos[0, :2] = [100.0, -50.0]
    mujoco.mj_forward(world.model, data)
    center = data.body("target").xpos
    for angle in np.linspace(0.0, 2 * np.pi, 16):
        point = center + 5.0 * np.array([math.cos(angle), math.sin(angle), 0.0])
        assert seen(world.model, data, "target_follow", point, 16 / 9) < 1.0


@each("planar", "spatial", "rolling", "seven axes")
def test_the_exported_model_is_the_same_world(keys: dict, compiled) -> None:
    """model.xml recompiles to the same numbers, and runs by itself to the same bits."""
    sensing = {"position": {"noise": 0.02}, "velocity": {"noise": 0.01}}
    disturbance = [f"{1 / 3}*sin(t)", 0.1, "exp(-t)/3", *[0.7] * 4][: keys.get("axes", 2)]
    world = world_of(
        {**keys, "sensing": sensing, "uncertainty": {"disturbance": disturbance}, "seed": 2**53 - 1}
    )
    again = mujoco.MjModel.from_xml_string(world.xml)
    assert again.numeric_data.tobytes() == world.model.numeric_data.tobytes()
    plan = plan_of(world)
    assert again.numeric_data[: len(plan)].tobytes() == plan.tobytes()
    for field in ("qpos0", "body_pos", "body_mass", "geom_size", "actuator_forcerange", "cam_pos"):
        assert getattr(again, field).tobytes() == getattr(world.model, field).tobytes(), field
    with native_loop(world):
        plant = Plant(world)
        plant.step(500)
        data = mujoco.MjData(again)
        mujoco.mj_step(again, data, nstep=500)
    assert data.userdata.tobytes() == plant.data.userdata.tobytes()
    assert data.qpos.tobytes() == plant.data.qpos.tobytes()
    assert data.qvel.tobytes() == plant.data.qvel.tobytes()


def plan_of(world: World) -> np.ndarray:
    """The plan that a world without the truth channel carries."""
    coordinates, columns = world.sizes["coordinate"], world.bodies.columns
    sampling = Sampling(world.schedule.stride, kept=True, coordinates=coordinates, groups=4, columns=columns)
    return pack(world.setup, sampling)


def test_many_robots() -> None:
    """MuJoCo's reader takes at most 500 numbers at once: the plan of a large team has more."""
    world = world_of({"robots": {"count": 200, "placement": {"within": 60, "least_gap": 0.1}}})
    assert world.model.nbody == 202
    plan = plan_of(world)
    assert len(plan) > 500
    assert world.model.numeric_data[: len(plan)].tobytes() == plan.tobytes()
    addresses = unpack_addresses(behind(world.model.numeric_data.ctypes.data), 2)
    assert addresses.qpos_address.tolist() == list(range(0, 400, 2))
    with native_loop(world):
        plant = Plant(world)
        plant.step(20)
    assert plant.data.time == pytest.approx(0.04) and np.isfinite(plant.record).any()
    assert np.array_equal(plant.state.q_measured, plant.state.q)
    assert np.abs(plant.state.tau).max() > 0.0


def test_numbers_too_small_to_be_normal_are_none() -> None:
    scenario = Scenario.model_validate({**PLANAR, "uncertainty": {"disturbance": [1e-320, 1.0]}})
    assert build(scenario).model.nu == 6


def test_thousands_of_obstacles_have_the_memory_that_their_pairs_take(compiled: None) -> None:
    """MuJoCo's own guess of its memory held 1,900 bodies; one more ended the step by a fatal error."""
    rocks = [{"position": [100 + 3 * (i % 70), 3 * (i // 70)]} for i in range(2500)]
    world = world_of({"robots": {"count": 3}, "obstacles": rocks, "duration": 0.1})
    again = mujoco.MjModel.from_xml_string(world.xml)
    assert again.narena == world.model.narena
    with native_loop(world):
        plant = Plant(world)
        plant.step(2)
    assert plant.data.time == pytest.approx(2 * world.model.opt.timestep)
    assert world_of(PLANAR).model.narena < 2**24, "a small world takes no more than MuJoCo's own guess"


def test_what_mujoco_gives_up_is_an_error_with_its_words(compiled: None) -> None:
    rocks = [{"position": [100 + 3 * i, 0]} for i in range(200)]
    world = world_of({"robots": {"count": 3}, "obstacles": rocks, "duration": 0.1})
    section(world.tree, "size").set("memory", "64K")
    with native_loop(world):
        plant = Plant(replace(world, model=mujoco.MjModel.from_xml_string(world.xml)))
        with pytest.raises(MujocoError, match="MuJoCo cannot step this world: .*memory"):
            plant.step(1)
