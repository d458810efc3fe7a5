"""Arguments of environments that are not what they must be."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import escort_mj
from escort_mj.environments import Simulation
from escort_mj.environments.dataset import law_episode
from escort_mj.errors import UsageError

pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")
pytest.importorskip("dm_env")

from escort_mj.environments.dm import EscortEnvironment  # noqa: E402
from escort_mj.environments.parallel import EscortParallelEnv  # noqa: E402
from escort_mj.environments.single import EscortEnv  # noqa: E402
from escort_mj.environments.vector import EscortVectorEnv  # noqa: E402

PLACES = "expected a file, the name of a shipped scenario, or a mapping"


@pytest.mark.parametrize(
    ("make", "arguments", "options", "message"),
    [
        (EscortVectorEnv, ("main", 16), {}, "num_envs is 'main'; expected a whole number of at least 1"),
        (EscortVectorEnv, (2.0,), {}, "num_envs is 2.0; expected a whole number of at least 1"),
        (EscortVectorEnv, (2, 16), {}, f"scenario: found 16; {PLACES}"),
        (EscortVectorEnv, (2,), {"threads": "4"}, "threads is '4'; expected a whole number of at least 1"),
        (EscortVectorEnv, (2,), {"threads": 0}, "threads is 0; expected a whole number of at least 1"),
        (
            EscortVectorEnv,
            (2,),
            {"autoreset_mode": "never"},
            "autoreset_mode is 'never'; expected one of NextStep, SameStep, Disabled",
        ),
        (EscortVectorEnv, (2, "main", "speed"), {}, "command is 'speed'; expected velocity or force"),
        (EscortEnv, (16,), {}, f"scenario: found 16; {PLACES}"),
        (EscortEnv, ("main", "velocity", 1.0), {}, r"reward is 1.0; expected None or Reward\(...\)"),
        (EscortEnv, (), {"rival_reward": 1}, r"rival_reward is 1; expected None or RivalReward\(...\)"),
        (EscortEnv, (), {"size": 640}, "size is 640; expected width and height in pixels"),
        (EscortEnv, (), {"size": (640, 0)}, r"size is \(640, 0\); expected width and height in pixels"),
        (EscortParallelEnv, (None,), {}, f"scenario: found None; {PLACES}"),
        (EscortParallelEnv, ("main", ["force"]), {}, r"command is \['force'\]; expected velocity or force"),
        (EscortEnvironment, ("main", 3), {}, "command is 3; expected velocity or force"),
        (Simulation, (b"main",), {}, f"scenario: found b'main'; {PLACES}"),
        (law_episode, (None, "speed"), {}, "command is 'speed'; expected velocity or force"),
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
