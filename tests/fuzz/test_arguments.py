"""Wrong kinds for each argument of each public function: one clear error, and never another exception."""

import inspect
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest

import escort_mj
from escort_mj import Area, Controller, EscortError, Limits
from escort_mj.api import cases
from escort_mj.environments import Reward, Simulation

KEYS = {
    "duration": 0.1,
    "target": {"position": [0, 0]},
    "robots": {"positions": [[3, 0], [-3, 0.5]]},
    "mission": {"radius": 3},
}
NAN = float("nan")
WRONG: list[Any] = [
    *(None, True, 5, -1, 1.5, NAN, float("inf"), 1e308, 1j, "", "x", "\0", b"x", (), [None], ["x"], [[1]]),
    *({}, {"x": 1}, {3: 4}, object(), print, int, np.zeros((2, 3)), np.full(2, NAN), np.ones((2, 2)) * 1j),
    *(np.array("x"), np.ma.masked_array(np.zeros((2, 2)), mask=True), np.zeros((0,)), range(3)),
]  # fmt: skip
WRONG += [type("Number", (), {"__index__": lambda self: 3})(), pandas.Series([1, 2]), range(10**9)]
PLACES, STILL = np.array([[3.0, 0.0], [-3.0, 0.5]]), np.zeros((2, 2))


class Call:
    """A public function, and arguments that it accepts where it needs some.

    Args:
        make: Returns the function, anew for each call.
        good: Arguments that it accepts.
        skip: Arguments whose wrong values are files, folders, or take long.
    """

    def __init__(self, make: Callable[[], Callable[..., Any]], *skip: str, **good: Any) -> None:
        self.make, self.good, self.skip = make, good, {"self", *skip}


def controller() -> Controller:
    made = Controller(KEYS, limits=Limits())
    made(0.0, PLACES, STILL)
    return made


def simulation() -> Simulation:
    made = Simulation(KEYS)
    made.reset()
    return made


CALLS = {
    "Controller": Call(lambda: Controller, "plugins", scenario=KEYS),
    "Controller()": Call(controller, time=0.002, positions=PLACES, velocities=STILL),
    "Controller.reset": Call(lambda: controller().reset),
    "Controller.command": Call(lambda: controller().command, time=0.0),
    "Controller.stop": Call(lambda: controller().stop),
    "Controller.robot": Call(lambda: controller().robot, number=1),
    "Controller.snapshot": Call(lambda: controller().snapshot),
    "Controller.restore": Call(lambda: controller().restore, snapshot={}),
    "RobotController()": Call(lambda: controller().robot(1), time=0.0, position=PLACES[0], velocity=STILL[0]),
    "RobotController.restore": Call(lambda: controller().robot(1).restore, snapshot={}),
    "Limits": Call(lambda: Limits),
    "Area.box": Call(lambda: Area.box, low=[0, 0], high=[1, 1]),
    "Area.sphere": Call(lambda: Area.sphere, center=[0, 0], radius=1),
    "Area.polygon": Call(lambda: Area.polygon, corners=[[0, 0], [1, 0], [0, 1]]),
    "load_scenario": Call(lambda: escort_mj.load_scenario, "plugins", source=KEYS),
    "Scenario.replace": Call(lambda: escort_mj.load_scenario(KEYS).replace),
    "start": Call(lambda: escort_mj.start, "plugins", scenario=KEYS),
    "step": Call(lambda: escort_mj.start(KEYS).step),
    "push": Call(lambda: escort_mj.start(KEYS).push, robot=1, force=[0, 0]),
    "release": Call(lambda: escort_mj.start(KEYS).release),
    "move_target": Call(lambda: escort_mj.start(KEYS).move_target, position=[0, 0]),
    "change": Call(lambda: escort_mj.start(KEYS).change),
    "on_sample": Call(lambda: escort_mj.start(KEYS).on_sample, watcher=print),
    "restore": Call(lambda: escort_mj.start(KEYS).restore, snapshot=None),
    "getitem": Call(lambda: escort_mj.start(KEYS).__getitem__, name="q"),
    "run": Call(lambda: escort_mj.run, "out", "progress", scenario=KEYS),
    "run_many": Call(lambda: lambda scenarios, threads=None: list(escort_mj.run_many(scenarios, threads)),
                     scenarios=[]),
    "open_run": Call(lambda: escort_mj.open_run, path="nowhere"),
    "cases": Call(lambda: cases, paths=[]),
    "judge": Call(lambda: escort_mj.judge, "out", log="nowhere.csv", scenario=KEYS),
    "replay": Call(lambda: escort_mj.replay, log="nowhere.csv", scenario=KEYS),
    "table": Call(lambda: escort_mj.table, runs=[]),
    "Simulation": Call(lambda: Simulation, scenario=KEYS),
    "Simulation.reset": Call(lambda: simulation().reset),
    "Simulation.step": Call(lambda: simulation().step),
    "Simulation.push": Call(lambda: simulation().push, robot=1, force=[0.0, 0.0]),
    "Simulation.release": Call(lambda: simulation().release),
    "Simulation.restore": Call(lambda: simulation().restore, snapshot=None),
    "Reward": Call(lambda: Reward),
    "sweep": Call(lambda: escort_mj.sweep, "out", study="nowhere.yaml"),
    "tune": Call(lambda: escort_mj.tune, "out", study="nowhere.yaml"),
    "falsify": Call(lambda: escort_mj.falsify, "out", study="nowhere.yaml"),
    "compare": Call(lambda: escort_mj.compare, "out", scenario="nowhere.yaml"),
    "to_dataframe": Call(lambda: RUNS[0].to_dataframe),
    "plot": Call(lambda: RUNS[0].plot),
    "export": Call(lambda: RUNS[0].export, path="nowhere.x"),
}  # fmt: skip
RUNS: list[Any] = []


@pytest.fixture(autouse=True, scope="module")
def flown() -> None:
    RUNS[:] = [escort_mj.run(KEYS)]


def attempts(name: str) -> Iterator[tuple[str, Any]]:
    call = CALLS[name]
    signature = inspect.signature(call.make())
    for parameter in signature.parameters.values():
        if parameter.name in call.skip or parameter.kind in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL):
            continue
        for wrong in WRONG:
            yield parameter.name, wrong


def attempt(name: str, argument: str, wrong: Any) -> bool:
    """Whether a call was refused; anything but an error of this package is raised."""
    call = CALLS[name]
    function = call.make()
    try:
        if inspect.signature(function).parameters[argument].kind is inspect.Parameter.POSITIONAL_ONLY:
            function(wrong)
        else:
            function(**{**call.good, argument: wrong})
    except EscortError as error:
        assert str(error) and len(str(error)) < 20_000
        return True
    return False


def test_every_public_function_is_here() -> None:
    named = {name.split(".")[0].removesuffix("()") for name in CALLS}
    kinds = {
        "EscortError",
        "ScenarioError",
        "Outcome",
        "Run",
        "LiveMission",
        "LiveLog",
        "Scenario",
    }  # made by others
    elsewhere = {"reproduce"}  # each call takes minutes
    assert set(escort_mj.__all__) - kinds - elsewhere <= named
    methods = {name for name, one in vars(Controller).items() if inspect.isfunction(one) and name[0] != "_"}
    assert {f"Controller.{name}" for name in methods} <= CALLS.keys()


@pytest.mark.parametrize("name", CALLS)
def test_a_few_wrong_kinds(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    tried = list(attempts(name))
    for argument, wrong in tried[:: max(len(tried) // 6, 1)]:
        attempt(name, argument, wrong)


@pytest.mark.slow
@pytest.mark.parametrize("name", CALLS)
def test_all_wrong_kinds(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    refused = [attempt(name, *one) for one in attempts(name)]
    assert sum(refused) >= len(refused) // 3, "many of these are wrong for anything"
