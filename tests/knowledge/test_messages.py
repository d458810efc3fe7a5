"""Messages, one step at a time: who hears whom, when, and what is lost."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from escort_mj.behaviors import Surface
from escort_mj.control.setup import Setup
from escort_mj.estimators import Predict
from escort_mj.knowledge.sight import TargetSight
from escort_mj.memory.layout import State
from escort_mj.radios import Periodic, Radio
from escort_mj.sensing.sensors import Sensors
from tests.control.twins import Kernel, mission

STEP = 0.002
LINE = np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [7.0, 0.0]])


def told(**keys: Any) -> Radio:
    """A radio that sends at a rate."""
    return Periodic(**keys)


def listening(radio: Radio) -> Setup:
    setup, _, _ = mission(2, 5, count=4, obstacles=0)
    sight = TargetSight(robots=(1,))
    return replace(
        setup, behaviors=(Surface(),), sensing=Sensors(), radio=radio, sight=sight, estimator=Predict()
    )


class Team:
    """Four robots on a line, which do not move."""

    def __init__(self, radio: Radio, **changes: Any) -> None:
        self.kernel, self.step = Kernel(replace(listening(radio), **changes)), 0

    def walk(self, steps: int) -> State:
        for _ in range(steps):
            state = self.kernel.evaluate(self.step * STEP, LINE, np.zeros((4, 2)))
            self.step += 1
        return state


def heard(state: State) -> list[set[int]]:
    """Whom each robot hears, from 1."""
    return [set(row[row > 0].astype(int).tolist()) for row in state.heard_from]


def test_range_and_surface() -> None:
    state = Team(told(range=2.5)).walk(1)
    assert heard(state) == [{2}, {1, 3}, {2}, set()]
    assert heard(Team(told(range=1.99)).walk(1)) == [set()] * 4
    assert heard(Team(told(range=1.99, measure="surface")).walk(1))[:2] == [{2}, {1, 3}]


def test_graphs() -> None:
    assert heard(Team(told(graph="ring")).walk(1)) == [{2, 4}, {1, 3}, {2, 4}, {1, 3}]
    assert heard(Team(told(graph={"edges": [(1, 3)]})).walk(1)) == [{3}, set(), {1}, set()]
    assert heard(Team(told(graph={"nearest": 1})).walk(1)) == [{2}, {1}, {2}, {3}]
    assert heard(Team(told(graph={"nearest": 2})).walk(2))[3] == {2, 3}
    assert Periodic().senders(40).shape == (40, 8), "a large team listens to eight"


def test_a_message_takes_its_time_and_is_stamped() -> None:
    team = Team(told(graph="ring", rate=50.0, delay=0.006))
    assert heard(team.walk(3)) == [set()] * 4, "sent at 0 s, it arrives 6 ms later"
    state = team.walk(1)
    assert heard(state)[1] == {1, 3} and state.link_step[1].tolist() == [0.0, 0.0]
    assert state.belief_fix[1] == 0.0
    state = team.walk(10)
    assert state.link_step[1].tolist() == [10.0, 10.0]
    assert state.belief_fix[1] == pytest.approx(0.02), "what robot 1 saw when it sent its second message"
    assert state.messages_sent.tolist() == [2.0] * 4


def test_what_robots_hear_they_pass_on() -> None:
    """One hop a message: robot 4 is three hops from the one that sees the target in every step."""
    team = Team(told(graph={"edges": [(1, 2), (2, 3), (3, 4)]}, rate=100.0))
    state = team.walk(26)
    assert [round((state.time[0] - fix) / STEP) for fix in state.belief_fix] == [0, 0, 5, 10]


def test_silence_between_parts_and_of_a_radio() -> None:
    parted = {"after": 0.01, "before": 0.02, "groups": ((1, 2), (3, 4))}
    team = Team(told(timeout=0.003, blackouts=(parted, {"after": 0.03, "robots": (4,)})))
    everybody = [{2, 3, 4}, {1, 3, 4}, {1, 2, 4}, {1, 2, 3}]
    assert heard(team.walk(5)) == everybody
    assert heard(team.walk(5)) == [{2}, {1}, {4}, {3}]
    assert heard(team.walk(5)) == everybody
    assert heard(team.walk(5)) == [{2, 3}, {1, 3}, {1, 2}, set()]


@pytest.mark.parametrize("loss", [0.3, {"mean": 0.3, "burst": 6.0}])
def test_loss(loss: Any) -> None:
    """The share and, in bursts, the mean number of messages lost in a row."""
    team = Team(told(loss=loss))
    lost = np.array([team.walk(1).messages_lost.copy() for _ in range(3000)])
    missed = np.diff(lost[:, 0])
    assert lost[-1].sum() / (3000 * 12) == pytest.approx(0.3, abs=0.02)
    bad = np.array([team.walk(1).link_kept[0, 0] for _ in range(6000)])
    runs = bad.sum() / (np.diff(bad) == 1.0).sum()
    assert runs == pytest.approx(1.0 / 0.7 if loss == 0.3 else 6.0, rel=0.2)
    assert missed.max() <= 3


def test_delays_and_send_times_are_drawn_within_their_bounds() -> None:
    team = Team(told(graph={"edges": [(1, 2)]}, rate=50.0, delay=(0.004, 0.012), jitter=0.006))
    before, ages, stamps = -1.0, [], []
    for step in range(4000):
        newest = float(team.walk(1).link_step[1, 0])
        if newest != before:
            ages.append(step - newest)
            stamps.append(newest % 10)
            before = newest
    assert (min(ages[1:]), max(ages[1:])) == (2, 6)
    assert (min(stamps), max(stamps)) == (0, 3)
    assert len(set(ages)) == 5 and len(set(stamps)) == 4


def test_the_nearest_keep_their_slots_and_the_stale_lose_them() -> None:
    team = Team(told(graph={"nearest": 2}, timeout=0.01))
    team.walk(3)
    assert heard(team.kernel.state)[0] == {2, 3}
    silent = ({"after": 0.01, "robots": (2,)},)
    team = Team(told(graph={"nearest": 2}, timeout=0.004, range=6.0, blackouts=silent))
    assert heard(team.walk(3))[2] == {2, 4}
    assert heard(team.walk(12))[2] == {1, 4}, "robot 2 has fallen silent"
