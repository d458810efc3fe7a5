"""The radio with time slots: one robot at a time, each once in a frame."""

import numpy as np
import pytest

from escort_mj import ScenarioError, load_scenario, run
from escort_mj.radios.time_slots import TimeSlots
from escort_mj.scenario import parse_scenario
from tests.knowledge.test_messages import STEP, Team


def test_each_robot_sends_in_its_slot_and_no_other() -> None:
    """Slots of three steps, four robots: a frame has twelve steps."""
    team, sent = Team(TimeSlots(slot=3 * STEP)), []
    for _ in range(48):
        sent.append(team.walk(1).messages_sent.copy())
    steps, robots = np.nonzero(np.diff(sent, axis=0, prepend=0.0))
    assert steps.tolist() == list(range(0, 48, 3))
    assert robots.tolist() == [0, 1, 2, 3] * 4


def test_delay_and_loss_are_those_of_every_radio() -> None:
    team = Team(TimeSlots(slot=STEP, delay=2 * STEP, loss=0.5))
    state = team.walk(2)
    assert state.messages_heard.sum() == 0.0 and state.messages_sent.tolist() == [1.0, 1.0, 0.0, 0.0]
    state = team.walk(400)
    lost, heard = state.messages_lost.sum(), state.messages_heard.sum()
    assert 0.4 < lost / (lost + heard) < 0.6


def test_a_mission_in_which_never_two_robots_send_at_once(compiled: None) -> None:
    found = run(
        load_scenario("knowledge/time_slots", {"duration": 4.0, "recording.rate": 500.0, "expect": []})
    )
    sent = np.diff(found.trace["messages_sent"].values, axis=0)
    assert sent.sum(axis=1).max() == 1 and np.ptp(sent.sum(axis=0)) <= 1


def test_slots_are_whole_steps() -> None:
    with pytest.raises(ScenarioError, match=r"communication.slot: found 0.003 s, 1.5 steps of 0.002 s"):
        parse_scenario("communication: {radio: time_slots, slot: 0.003}")
