"""One source: kernels as plain Python and as machine code step shipped missions to the same whole state."""

from pathlib import Path

import numpy as np
import pytest

import escort_mj
from escort_mj.errors import EscortError
from escort_mj.memory.layout import LAYOUT, State
from escort_mj.scenario import load_file
from escort_mj.scenario.mission import Mission
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import build
from escort_mj.world.plant import Plant
from tests.test_scenarios import FOLDER, WELL

# Of the largest number of a field. Machine code contracts multiplications and additions. A force that moves a
# body at a velocity within a step has 500 times its rounding, a velocity by a stiff program 10,000 times.
EQUAL = 1e-10
SCRATCH = {"scratch", "belief_work", "operands", "samples", "spare"}  # what is left of work between two uses
TIES = {"clearance_body"}  # which of two bodies that are equally near
MOST_ROBOTS = 40
QUICK = [
    *("main", "main_3d", "patrol", "one_of_six_fails", "supervised", "event_triggered", "truth"),
    *("knowledge/relay", "knowledge/lidar", "pursuit/intruders", "pursuit/handover", "robots/quadrotor"),
    *("goals/swap", "worlds/corridor", "paper/case3_3d_obstacle"),
]


def state_of(plant: Plant) -> dict[str, np.ndarray]:
    """The controller's whole state, and MuJoCo's."""
    found = {name: getattr(plant.state, name).copy() for name in LAYOUT.fields[State].keys() - SCRATCH - TIES}
    return found | {"qpos": plant.data.qpos.copy(), "qvel": plant.data.qvel.copy()}


def assert_agree(path: Path, steps: int) -> None:
    """Both step from the same state, so that rounding does not grow from step to step."""
    plant = Plant(build(load_file(path)))
    for number in range(steps):
        before, found = plant.mark(), []
        for interpret in (True, False):
            plant.back_to(before)
            with native_loop(plant.world, interpret=interpret):
                plant.step(1)
            found.append(state_of(plant))
        interpreted, compiled = found
        assert compiled["evaluated"][0] == interpreted["evaluated"][0] == number
        for name, values in compiled.items():
            largest = np.abs(values[np.isfinite(values)]).max(initial=1.0)
            np.testing.assert_allclose(
                interpreted[name], values, rtol=0.0, atol=EQUAL * largest, err_msg=name
            )


@pytest.mark.parametrize("name", QUICK)
def test_interpreted_and_compiled_agree_on_the_whole_state(name: str, compiled: None) -> None:
    assert_agree(FOLDER / f"{name}.yaml", steps=2)


@pytest.mark.slow
@pytest.mark.parametrize("path", WELL, ids=lambda path: str(path.relative_to(FOLDER)))
def test_they_agree_in_every_shipped_mission(path: Path, compiled: None) -> None:
    if Mission(load_file(path)).setup.count > MOST_ROBOTS:
        pytest.skip("a crowd, in which Python takes minutes; its kernels are those of the smaller ones")
    assert_agree(path, steps=10)


def test_what_a_law_raises_comes_with_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*arguments: object) -> None:
        raise EscortError("stopped here")

    monkeypatch.setattr("escort_mj.laws.apd_smc.switching", stop)
    with pytest.raises(EscortError, match="stopped here") as raised:
        escort_mj.run("patrol", interpreted=True)
    assert any(entry.path.name == "apd_smc.py" for entry in raised.traceback)
    monkeypatch.undo()
    assert escort_mj.run(escort_mj.load_scenario("patrol", {"duration": 0.1, "expect": []})).passed
