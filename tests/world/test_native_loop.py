"""The native callbacks beside the rest of the process: models, callbacks, threads, broken states."""

import ctypes
import threading

import mujoco
import numpy as np
import pytest
from mujoco import batch

from escort_mj.world.callback import native_loop
from escort_mj.world.loop.library import library
from escort_mj.world.model.build import World
from escort_mj.world.plant import Plant
from tests.corpus import missions

MISSIONS = missions(__file__)


def bits(data: mujoco.MjData) -> tuple[bytes, ...]:
    """Everything of a state that must repeat: physics, controller, record."""
    return tuple(
        np.asarray(getattr(data, field)).tobytes()
        for field in ("time", "qpos", "qvel", "ctrl", "qfrc_applied", "mocap_pos", "userdata")
    )


STEPS = 600
NOISY = {"sensing": {"position": {"noise": 0.02}, "velocity": {"noise": 0.01}}}
FAILING = [{"robot": 1, "at": 0.2, "kind": "mad"}, {"robot": 2, "at": 0.3, "kind": "stuck"}]
FAILING += [{"robot": 3, "at": 0.3, "notice": 0.1}]
KINDS = {
    "plane": MISSIONS["mission"],
    "space": {"axes": 3, "seed": 2},
    "four axes": {"axes": 4, **NOISY},
    "five axes": {"axes": 5, **NOISY},
    "failures": {"robots": {"count": 5, "failures": FAILING}},
}


@pytest.fixture(scope="module")
def worlds(make_world) -> dict[str, World]:
    return {name: make_world(**keys) for name, keys in KINDS.items()}


@pytest.fixture(scope="module")
def world(worlds) -> World:
    return worlds["plane"]


def stepped(world: World, step=None) -> tuple[bytes, ...]:
    """The state after all steps, at once or one by one in some way."""
    with native_loop(world):
        plant = Plant(world)
        if step is None:
            plant.step(STEPS)
        for _ in range(0 if step is None else STEPS):
            step(plant)
        return bits(plant.data)


@pytest.fixture(scope="module")
def undisturbed(worlds) -> dict[str, tuple[bytes, ...]]:
    """The state of each world after steps that nothing interrupts."""
    return {name: stepped(world) for name, world in worlds.items()}


def one_by_one(plant: Plant) -> None:
    plant.step(1)


def looked_at(plant: Plant) -> None:
    """A viewer or a renderer calls mj_forward whenever it likes: that advances nothing."""
    mujoco.mj_forward(plant.world.model, plant.data)
    mujoco.mj_forward(plant.world.model, plant.data)
    plant.step(1)


def by_halves(plant: Plant) -> None:
    mujoco.mj_step1(plant.world.model, plant.data)
    mujoco.mj_step2(plant.world.model, plant.data)


@pytest.mark.parametrize(
    "step", [lambda plant: plant.step(1), looked_at, by_halves], ids=["single", "looked at", "halves"]
)
@pytest.mark.parametrize("name", ["plane", "five axes", "failures"])
def test_the_same_bits_in_any_way_of_stepping(name: str, step, worlds, undisturbed) -> None:
    assert stepped(worlds[name], step) == undisturbed[name]


def test_reset_begins_anew(world, undisturbed) -> None:
    with native_loop(world):
        plant = Plant(world)
        plant.step(STEPS // 2 + 7)
        assert bits(plant.data) != undisturbed["plane"]
        plant.reset()
        assert not plant.data.userdata.any()
        plant.step(1)
        np.testing.assert_array_equal(plant.state.q_d, world.team.position)
        plant.step(STEPS - 1)
    assert bits(plant.data) == undisturbed["plane"]


PENDULUM = """
<mujoco>
  {extra}
  <worldbody><body><joint name="hinge" axis="0 1 0"/><geom size="0.1" pos="0.5 0 0"/></body></worldbody>
  <actuator><motor joint="hinge"/></actuator>
  <sensor><user name="mine" dim="1" needstage="acc"/></sensor>
</mujoco>
"""
FOREIGN = {
    "no_numerics": "<size nuserdata='50'/>",
    "own_numeric": "<custom><numeric name='gains' data='1 2 3'/></custom><size nuserdata='50'/>",
    "zero_numeric": "<custom><numeric name='escort_plan' data='0'/></custom>",
}


@pytest.mark.parametrize("extra", FOREIGN.values(), ids=FOREIGN)
def test_foreign_models_are_left_alone(extra: str, world) -> None:
    model = mujoco.MjModel.from_xml_string(PENDULUM.format(extra=extra))

    def swing() -> tuple[bytes, ...]:
        data = mujoco.MjData(model)
        data.ctrl[:] = 0.125
        data.userdata[:] = 7.0
        mujoco.mj_step(model, data, nstep=200)
        return bits(data), data.sensordata.tobytes()

    alone = swing()
    with native_loop(world):
        assert swing() == alone


def test_a_model_compiles_while_the_callbacks_are_installed(world) -> None:
    with native_loop(world):
        assert mujoco.MjModel.from_xml_string(world.xml).nq == world.model.nq


def installed() -> tuple:
    loaded = library()
    return (
        mujoco.get_mjcb_control(),
        mujoco.get_mjcb_sensor(),
        ctypes.c_void_p.in_dll(loaded, "mjcb_time").value,
        ctypes.c_void_p.in_dll(loaded, "mju_user_warning").value,
    )


def test_what_was_installed_comes_back(world) -> None:
    before = installed()
    assert before[:2] == (None, None) and before[2]
    with native_loop(world):
        inside = installed()
        assert inside[0] is not None and inside[1] is not None and inside[2] is None
        with native_loop(world):
            assert installed() == inside
        assert installed() == inside, "an inner loop took the callbacks away from the outer one"
    assert installed() == before


def test_what_was_installed_comes_back_after_an_error(world) -> None:
    before = installed()
    with pytest.raises(ZeroDivisionError), native_loop(world):
        raise ZeroDivisionError
    assert installed() == before


def test_somebody_elses_callbacks_come_back(world) -> None:
    calls = []

    def control(model, data) -> None:
        calls.append(data.time)

    def sensor(model, data, stage) -> None:
        calls.append(stage)

    model = mujoco.MjModel.from_xml_string(PENDULUM.format(extra=""))
    data = mujoco.MjData(model)
    try:
        mujoco.set_mjcb_control(control)
        mujoco.set_mjcb_sensor(sensor)
        with native_loop(world):
            mujoco.mj_step(model, data)
            assert not calls
        assert mujoco.get_mjcb_control() is control and mujoco.get_mjcb_sensor() is sensor
        mujoco.mj_step(model, data)
        assert len(calls) >= 2
    finally:
        mujoco.set_mjcb_control(None)
        mujoco.set_mjcb_sensor(None)


def test_different_worlds_in_turns(worlds, undisturbed) -> None:
    with native_loop(*worlds.values()):
        plants = {name: Plant(world) for name, world in worlds.items()}
        for _ in range(STEPS):
            for plant in plants.values():
                plant.step(1)
    assert {name: bits(plant.data) for name, plant in plants.items()} == undisturbed


@pytest.mark.parametrize("other", ["plane", "space", "four axes"])
def test_loops_of_threads_overlap(other: str, worlds, undisturbed) -> None:
    """Each enters and leaves by itself, all the time: callbacks stay until the last has left.

    Those of one class of axes give way to those that tell classes apart, in the midst of a thread's steps.
    """
    before, names = installed(), ("plane", other)
    found: dict[int, tuple[bytes, ...]] = {}

    def run(index: int) -> None:
        own = worlds[names[index % 2]]
        for part in range(15):
            with native_loop(own):
                if part == 0:
                    plant = Plant(own)
                plant.step(STEPS // 15)
        found[index] = bits(plant.data)

    threads = [threading.Thread(target=run, args=(index,)) for index in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert installed() == before
    assert [found[index] for index in range(4)] == [undisturbed[name] for name in names] * 2


@pytest.mark.parametrize("persistent", [False, True])
def test_a_batch_on_two_threads_is_the_serial_run(world, persistent: bool) -> None:
    starts = np.random.default_rng(0).normal(scale=0.3, size=(6, world.model.nq))
    serial = []
    with native_loop(world):
        for start in starts:
            plant = Plant(world)
            plant.data.qpos += start
            plant.step(500)
            serial.append(plant.data.userdata.tobytes() + plant.data.qpos.tobytes())
        many = batch.Batch(world.model, nsim=6, nthread=2, persistent=persistent)
        qpos, userdata = many.bind("qpos"), many.bind("userdata")
        qpos[:] += starts
        for _ in range(5):
            many.step(nstep=100)
    found = [userdata[i].tobytes() + qpos[i].tobytes() for i in range(6)]
    assert found == serial and len(set(found)) == 6


@pytest.mark.parametrize("field", ["qpos", "qvel"])
def test_a_state_that_is_no_number_stays_visible(field: str, world, tmp_path, monkeypatch) -> None:
    """MuJoCo would put the robots back to their start; here the NaN stays, counted as a warning."""
    monkeypatch.chdir(tmp_path)
    with native_loop(world):
        plant = Plant(world)
        plant.step(100)
        assert not plant.warnings()
        getattr(plant.data, field)[2] = np.nan
        for _ in range(3):
            plant.step(10)
            assert np.isnan(getattr(plant.data, field)[2])
    assert plant.data.time == pytest.approx(0.26)
    assert plant.warnings() and {"qpos": "BADQPOS", "qvel": "BADQVEL"}[field] in plant.warnings()
    assert np.isnan(plant.record).any()
    assert not list(tmp_path.iterdir()), "MuJoCo's log file must not litter the working folder"


def test_an_infinite_force_is_a_warning(make_world, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    flying = make_world(
        robots={"positions": [[3, 0]], "force_limit": None}, mission={"behaviors": ["surface"]}
    )
    with native_loop(flying):
        plant = Plant(flying)
        plant.data.qvel[0] = 1e200
        plant.step(20)
    assert plant.warnings()
    assert not list(tmp_path.iterdir())


def test_forward_at_the_same_time_moves_the_target_by_one_step_at_most(make_world) -> None:
    """The callback can set only where the next look at the world finds the target."""
    moving = make_world(target={"position": ["2*t", 0]}, robots={"positions": [[5, 5], [-5, 5]]})
    with native_loop(moving):
        plant = Plant(moving)
        plant.step(100)
        places = []
        for _ in range(3):
            mujoco.mj_forward(moving.model, plant.data)
            places.append(float(plant.data.body("target").xpos[0]))
        assert places[0] == pytest.approx(2 * plant.data.time, abs=1e-12)
        assert places[1] == places[2] == pytest.approx(places[0] + 2 * 0.002, abs=1e-12)
        assert float(plant.state.target_position[0]) == pytest.approx(places[0], abs=1e-12)
