"""Steps are folded when somebody looks, or when there is no room: whoever looks when, finds the same bits."""

from itertools import cycle
from typing import Any

import numpy as np
import pytest

import escort_mj
from escort_mj import Scenario
from escort_mj.environments.simulation import Simulation
from escort_mj.metrics.watching import NAMES
from escort_mj.mission import Flight, fly
from escort_mj.mission.session import Session
from escort_mj.record.outcome import Outcome
from escort_mj.world.callback import native_loop
from escort_mj.world.watcher import Watcher
from tests.corpus import missions
from tests.mission.test_between_samples import JUMPING, LEAP

ASKED = missions(__file__)["asked"]
SHORT = JUMPING.replace(duration=1.6, expect=ASKED)
CROWD = SHORT.replace(
    {"recording.rate": 5},
    duration=0.3,
    expect=ASKED[1:2] + ASKED[3:4],
    robots={"count": 90, "placement": {"within": 60, "least_gap": 0.1}},
    mission={"radius": 60.0, "behaviors": ["surface"]},
)
ASKING = {
    "plain": SHORT,
    "blocks": SHORT.replace({"recording.rate": 500}, duration=9.0),
    "rare": SHORT.replace({"recording.rate": 0.1, "physics.timestep": 0.0005}, duration=4.0),
    "truth": SHORT.replace({"recording.truth": True}),
    "crowd": CROWD,
}
PATTERNS = {"steps": [None], "samples": [0.02], "mixed": [None, 0.05, 0.013, None, 0.3], "whole": [100.0]}


def bits(flight: Flight | Any) -> dict[str, Any]:
    """All that was recorded, bit for bit, and all verdicts."""
    found = {str(name): one.values.tobytes() for name, one in flight.trace.variables.items()}
    return found | {"verdicts": [one.message for one in flight.verdicts], "outcome": flight.outcome.value}


def stepped(mission: Any, pattern: list[float | None], look: bool, back: bool = False) -> None:
    """Step a mission to its end, looking at its samples after each step, or never.

    With `back`, it goes on from each moment twice.
    """
    for seconds in cycle(pattern):
        if mission.outcome is not Outcome.RUNNING:
            return
        mission.step(seconds)
        if back and mission.outcome is Outcome.RUNNING:
            then = mission.snapshot()
            mission.step(0.08)
            mission.restore(then)
        if look:
            assert not np.isnan(mission.samples).any()


@pytest.fixture
def folds(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many steps were folded each time."""
    found: list[int] = []
    plain = Watcher.fold

    def fold(self: Watcher, steps: Any, starts: Any) -> Any:
        found.append(len(steps))
        return plain(self, steps, starts)

    monkeypatch.setattr(Watcher, "fold", fold)
    return found


@pytest.mark.slow_cases("blocks-samples")
@pytest.mark.crossed
@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("name", ASKING)
def test_any_pattern_of_calls_gives_the_bits_of_a_run(name: str, pattern: str) -> None:
    if name in ("blocks", "rare") and pattern == "steps":
        pytest.skip("it takes long")
    scenario = ASKING[name]
    whole = bits(fly(scenario))
    for look in (False, True):
        mission = escort_mj.start(scenario)
        stepped(mission, PATTERNS[pattern], look, back=pattern == "mixed")
        assert bits(mission.run()) == whole


def test_nothing_is_folded_until_somebody_looks_or_there_is_no_room(folds: list[int]) -> None:
    mission = escort_mj.start(SHORT)
    stepped(mission, [0.02], look=False)
    assert folds == [1], "the first step of all"
    mission.run()
    assert len(folds) == 2
    folds.clear()
    mission = escort_mj.start(ASKING["blocks"])
    stepped(mission, [0.02], look=False)
    room = len(mission.plant.state.steps)
    assert len(folds) == 2 and room <= folds[1] < room + 10


def test_signals_of_a_mission_are_those_of_its_last_sample() -> None:
    mission, other = (escort_mj.start(SHORT) for _ in range(2))
    for _ in range(3):
        mission.step(0.06)
        row = mission.run().trace
        other.step(0.06)
        for signal in NAMES:
            np.testing.assert_array_equal(other[signal], row[signal].values[-1])


@pytest.mark.slow
def test_what_comes_from_outside_meets_steps_set_aside() -> None:
    """Pushes, changes, moved targets and moments, whether or not anybody looked before them."""
    found = []
    for look in (False, True):
        mission = escort_mj.start(SHORT)

        def on(seconds: float, mission: Any = mission, look: bool = look) -> None:
            for _ in range(round(seconds / 0.02)):
                mission.step(0.02)
                if look:
                    assert len(mission.samples)

        on(0.2)
        mission.push(2, [60.0, 0.0], seconds=0.11)
        on(0.2)
        mission.move_target([0.3, 0.2])
        on(0.2)
        then = mission.snapshot()
        on(0.2)
        mission.change({"mission.radius": 3.0})
        on(0.1)
        mission.restore(then)
        on(0.1)
        mission.change({"mission.max_speed": 0.8})
        on(0.1)
        other = escort_mj.start(SHORT)
        other.step(0.1)
        other.restore(mission.snapshot())
        stepped(mission, [0.02], look)
        stepped(other, [0.07], look)
        assert bits(mission.run()) == bits(other.run())
        found.append(bits(mission.run()))
    assert found[0] == found[1]


def test_what_is_taken_back_leaves_what_was_set_aside() -> None:
    """The target leaps within a long step, after short ones: samples behind the leap are not kept."""
    scenario = SHORT.replace(target={"position": [LEAP.format(100.0, 1.1), "0"]})
    whole = fly(scenario)
    assert whole.outcome is Outcome.DIVERGED and 0.9 < whole.trace["time"].values[-1] < 1.2
    for pattern in ([0.02], [0.02] * 20 + [1.2], [0.5]):
        for look in (False, True):
            mission = escort_mj.start(scenario)
            stepped(mission, pattern, look)
            assert bits(mission.run()) == bits(whole)
            np.testing.assert_array_equal(mission["watch_value"], whole.trace["watch_value"].values[-1])


def test_steps_set_aside_before_a_mark_come_back_with_it() -> None:
    session = Session(SHORT)
    plant, size = session.plant, session.world.record_size
    with native_loop(session.world):
        first, second, again = (np.empty((5, size)) for _ in range(3))
        plant.fill(first)
        mark = plant.mark()
        plant.fill(second)
        plant.back_to(mark)
        assert np.array_equal(plant.record, first[-1])
        plant.back_to(mark)
        plant.fill(again)
        plant.fold_steps()
    assert np.array_equal(again, second) and np.array_equal(plant.record, second[-1])


@pytest.mark.parametrize("force", [0.3, 1e9])
def test_a_commanded_mission_that_breaks_is_the_same_whoever_looks(force: float) -> None:
    scenario: Scenario = SHORT.replace({"robots.force_limit": 1e9 if force > 1.0 else 40.0})
    found = []
    for look in (False, True):
        simulation = Simulation(scenario, "force")
        simulation.reset(3)
        wish = np.ones((4, 2)) * (1.0 if force > 1.0 else force)
        while simulation.under_way:
            simulation.step(wish)
            if look:
                assert not np.isnan(simulation.samples(simulation.commands - 1)).any()
            if simulation.commands == 20:
                then = simulation.snapshot()
        found.append(bits(simulation.run()))
        if force < 1.0:
            simulation.restore(then)
            while simulation.under_way:
                simulation.step(wish)
            assert bits(simulation.run()) == found[0]
    assert found[0] == found[1]
    assert (found[0]["outcome"] == "completed") == (force < 1.0)
