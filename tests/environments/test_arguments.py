"""Arguments of environments that are not what they must be."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import escort_mj
from escort_mj.environments import Simulation
from escort_mj.environments.senses import Reward
from escort_mj.errors import UsageError

pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")

from escort_mj.environments.parallel import EscortParallelEnv  # noqa: E402
from escort_mj.environments.single import EscortEnv  # noqa: E402
from escort_mj.environments.vector import EscortVectorEnv  # noqa: E402

PLACES = "expected a Scenario or a file, the name of a shipped scenario, or a mapping"


class Mute:
    """An argument that cannot be shown."""

    def __repr__(self) -> str:
        raise RuntimeError("no text")


@pytest.mark.parametrize(
    ("make", "arguments", "options", "message"),
    [
        (EscortVectorEnv, ("main", 16), {}, 'num_envs: found "main"; expected a whole number of at least 1'),
        (EscortVectorEnv, (10**30,), {}, "num_envs: found .*; expected a whole number of at least 1 and at"),
        (EscortVectorEnv, (2.0,), {}, "num_envs: found 2.0; expected a whole number of at least 1"),
        (EscortVectorEnv, (2, 16), {}, f"scenario: found 16; {PLACES}"),
        (
            EscortVectorEnv,
            (2,),
            {"threads": "4"},
            'threads: found "4"; expected a whole number of at least 1',
        ),
        (EscortVectorEnv, (2,), {"threads": 0}, "threads: found 0; expected a whole number of at least 1"),
        (
            EscortVectorEnv,
            (2,),
            {"autoreset_mode": "never"},
            'autoreset_mode: found "never"; expected one of NextStep, SameStep, Disabled',
        ),
        (
            EscortVectorEnv,
            (2, "main", "speed"),
            {},
            'command: found "speed"; expected velocity, residual or force',
        ),
        (EscortEnv, (16,), {}, f"scenario: found 16; {PLACES}"),
        (EscortEnv, ("main", "velocity", 1.0), {}, "reward: found 1.0; expected a Reward or None"),
        (EscortEnv, (), {"rival_reward": 1}, "rival_reward: found 1; expected a RivalReward or None"),
        (EscortEnv, (), {"size": 640}, "size: found 640; expected width and height in pixels"),
        (EscortEnv, (), {"size": {64, 48}}, "size: found {.*}; expected width and height in pixels"),
        (EscortEnv, (), {"size": (640, 0)}, r"size: found \(640, 0\); expected width and height in pixels"),
        (EscortParallelEnv, (None,), {}, f"scenario: found None; {PLACES}"),
        (
            EscortParallelEnv,
            ("main", ["force"]),
            {},
            r"command: found \['force'\]; expected velocity, residual or force",
        ),
        (Simulation, (b"main",), {}, f"scenario: found b'main'; {PLACES}"),
        (escort_mj.run, (16,), {}, f"scenario: found 16; {PLACES}"),
        (escort_mj.sweep, (16,), {}, "study: found 16; expected a file, the name of a shipped study, or"),
    ],
)
def test_what_was_found_and_what_is_expected(
    make: Callable[..., Any], arguments: tuple[Any, ...], options: dict[str, Any], message: str
) -> None:
    with pytest.raises(UsageError, match=f"^{message}"):
        make(*arguments, **options)


def test_sizes_of_two_whole_numbers_of_any_kind() -> None:
    assert EscortEnv(size=[np.int64(64), 48])._camera._painter.size == (64, 48)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (np.full((5, 2), np.nan), r"command: found nan at \[0, 0\]; every number must be finite"),
        (np.zeros((1, 2)), r"command: found the shape \(1, 2\); .* shape \(5, 2\)"),
        (np.zeros(10), r"command: found the shape \(10,\)"),
        (np.ones((5, 2)) * 1j, "command: found complex numbers"),
        ("x", 'command: found "x"'),
    ],
)
def test_commands_that_are_none_change_nothing(command: Any, message: str) -> None:
    simulation = Simulation("main")
    simulation.reset()
    with pytest.raises(UsageError, match=f"^{message}"):
        simulation.step(command)
    with pytest.raises(UsageError, match="of_rivals: found commands"):
        simulation.step(None, np.zeros((1, 2)))
    assert simulation.commands == 1 and simulation.step(None).shape == (5,)


def test_options_weights_and_names_that_nobody_knows() -> None:
    for make in (EscortEnv, EscortParallelEnv):
        with pytest.raises(UsageError, match=r'options: found "seed"; expected .*set, or none'):
            make("main").reset(options={"seed": 3})
    with pytest.raises(
        UsageError, match=r"options: found 3; expected a table with reset_mask and set, or None"
    ):
        EscortVectorEnv(2).reset(options=3)  # type: ignore[arg-type]
    closed = EscortVectorEnv(2, threads=2)
    closed.close()
    assert closed.reset(seed=3)[0].shape == (2, 5, closed.fleet.senses.width), "by the thread that asks"
    for wrong in ([1], "1", 1.0, -1, True):
        with pytest.raises(UsageError, match=r"seed: found .*; expected a whole number of at least 0"):
            EscortEnv().reset(seed=wrong)  # type: ignore[arg-type]
    EscortEnv().reset(seed=np.int64(3))  # type: ignore[arg-type]
    with pytest.raises(UsageError, match='touch: found "much"; expected a weight'):
        Reward(touch="much")  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="touch: found a Mute without a text; expected a weight"):
        Reward(touch=Mute())  # type: ignore[arg-type]
    agents = EscortParallelEnv("main")
    agents.reset()
    with pytest.raises(UsageError, match='actions: found "robot_9"; expected names of agents: robot_1'):
        agents.step({"robot_9": np.zeros(2)})
    with pytest.raises(UsageError, match=r"action of robot_1: found the shape \(3,\)"):
        agents.step({"robot_1": np.zeros(3)})
