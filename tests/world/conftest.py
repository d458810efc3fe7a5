"""Small worlds, and runs of them step by step."""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import pytest

from escort_mj.scenario.mission import Mission
from escort_mj.scenario.schema.scenario import Scenario
from escort_mj.signals import SIGNALS
from escort_mj.world.callback import native_loop
from escort_mj.world.model.build import World, build
from escort_mj.world.plant import Plant

NO_FORCE = 1e-12  # a force limit that leaves robots to physics alone [N]


@pytest.fixture(scope="session")
def make_world(compiled: None) -> Callable[..., World]:
    """Builds a world from the keys of a scenario; the cross-checks of loading are left out."""

    def make(outside: Literal["force"] | None = None, **keys: Any) -> World:
        return build(Mission(Scenario.model_validate(keys), outside=outside))

    return make


@pytest.fixture(scope="session")
def drifting(make_world: Callable[..., World]) -> Callable[..., World]:
    """A world whose motors have no force: physics alone moves the robots."""

    def make(robots: dict[str, Any], **keys: Any) -> World:
        mission = {"radius": 5.0, "behaviors": ["surface"], "target_feedforward": False}
        return make_world(
            robots={"force_limit": NO_FORCE, **robots},
            **{"mission": mission, "target": {"position": [1e3] * keys.get("axes", 2)}, **keys},
        )

    return make


@pytest.fixture(scope="session")
def record_steps() -> Callable[..., dict[str, np.ndarray]]:
    """Steps a world and keeps the record of every physics step, by signal, first dimension time."""

    def run(
        world: World, steps: int, prepare: Callable[[Plant], Any] = id, after: Callable[[Plant], Any] = id
    ) -> dict[str, np.ndarray]:
        samples = []
        with native_loop(world):
            plant = Plant(world)
            prepare(plant)
            for _ in range(steps):
                plant.step(1)
                samples.append(plant.record.copy())
                after(plant)
        return by_signal(np.array(samples), world)

    return run


def by_signal(samples: np.ndarray, world: World) -> dict[str, np.ndarray]:
    """Names the parts of samples, shape (k, record_size)."""
    recorded = [signal for signal in SIGNALS if signal.recorded(world.sizes)]
    places = np.cumsum([signal.size(world.sizes) for signal in recorded])
    return {
        signal.name: part.reshape(len(samples), *(world.sizes[dim] for dim in signal.dims))
        for signal, part in zip(recorded, np.split(samples, places[:-1], axis=1), strict=True)
    }
