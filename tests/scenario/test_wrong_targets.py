"""Wrong targets with a policy: one fault each, with its place and what is allowed."""

import pytest

from tests.scenario.faults import assert_one_fault

WRONG = [
    ("target: {policy: fle}", "target.policy", 'did you mean "flee"?'),
    ("target: {policy: straight}", "target.policy", "an opponent's policy"),
    ("target: {policy: {policy: flee, speed: 0}}", "target.policy.speed", "more than 0"),
    ("target: {policy: {policy: flee, sight: -1}}", "target.policy.sight", "more than 0"),
    ("target: {policy: {policy: burst, wait: -1}}", "target.policy.wait", "at least 0"),
    ("target: {policy: {policy: burst, waits: 1}}", "target.policy.waits", 'did you mean "wait"?'),
    ("target: {policy: flee, position: [t, 0]}", "target.position[0]", "found an expression in t"),
    ("target: {policy: flee, waypoints: [{time: 0, position: [0, 0]}]}", "target.waypoints", "its start"),
    ("target: {policy: flee, body: {drag: -1}}", "target.body.drag", "at least 0"),
    ("target: {policy: flee, body: {gain: 1000}}", "target.body.gain", "at most 500"),
    ("target: {policy: {policy: follow, leader: robt_1}}", "target.policy.leader", 'did you mean "robot_1"?'),
    ("target: {policy: {policy: follow, leader: robot_6}}", "target.policy.leader", 'found "robot_6"'),
    ("target: {policy: {policy: follow, leader: target}}", "target.policy.leader", "the body itself"),
    ("target: {policy: {policy: follow, distance: 0.4}}", "target.policy.distance", "more than 0.5 m"),
    ("opponents: [{policy: {policy: follow, leader: opponent_1}}]", "opponents[0].policy.leader", "itself"),
    ("axes: 4\ntarget: {policy: flee}", "target.policy", "expected 2 or 3"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "path", "words"), WRONG)
def test_each_fault_is_one_message_with_its_place(text: str, path: str, words: str) -> None:
    assert_one_fault(text, path, words)
