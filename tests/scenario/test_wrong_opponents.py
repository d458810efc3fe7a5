"""Wrong tables `opponents`, and behaviors against opponents: one fault each, with its place."""

import pytest

from escort_mj.scenario import dump_scenario, parse_scenario
from tests.scenario.faults import assert_one_fault

GUARD = "mission: {behaviors: [avoid_obstacles, guard, surface]}"
WRONG = [
    ("opponents: [{count: 0}]", "opponents[0].count", "at least 1"),
    ("opponents: [{count: 101}]", "opponents[0].count", "at most 100"),
    ("opponents: [{policy: strait}]", "opponents[0].policy", 'did you mean "straight"?'),
    ("opponents: [{policy: {policy: weave, angle: 2}}]", "opponents[0].policy.angle", "at most 1.5"),
    ("opponents: [{policy: {policy: weave, period: 0}}]", "opponents[0].policy.period", "more than 0"),
    ("opponents: [{policy: {policy: patient, gap: 4}}]", "opponents[0].policy.gap", "at most 3.14"),
    ("opponents: [{policy: {policy: avoid, berth: 0}}]", "opponents[0].policy.berth", "more than 0"),
    ("opponents: [{policy: {policy: breach, perimeter: 0}}]", "opponents[0].policy.perimeter", "more than 0"),
    ("opponents: [{start: -1}]", "opponents[0].start", "at least 0"),
    ("opponents: [{interval: -1}]", "opponents[0].interval", "at least 0"),
    ("opponents: [{capture_distance: -1}]", "opponents[0].capture_distance", "at least 0"),
    ("opponents: [{reach_distance: -1}]", "opponents[0].reach_distance", "at least 0"),
    ("opponents: [{distance: 0}]", "opponents[0].distance", "at least"),
    ("opponents: [{radius: 0}]", "opponents[0].radius", "at least"),
    ("opponents: [{body: {mass: 0}}]", "opponents[0].body.mass", "at least"),
    ("opponents: [{body: {gain: 1000}}]", "opponents[0].body.gain", "at most 500"),
    ("opponents: [{cout: 2}]", "opponents[0].cout", 'did you mean "count"?'),
    ("opponents: [{positions: [[9, 9]], count: 2}]", "opponents[0].positions", "expected 2, as count says"),
    ("opponents: [{positions: [[9, 9, 9]]}]", "opponents[0].positions[0]", "expected 2, as axes says"),
    ("opponents: [{}, {}]", "opponents[1].name", "found the name opponent twice"),
    ("opponents: [{name: 'a b'}]", "opponents[0].name", "letters, digits"),
    ("target: null\nopponents: [{}]\nmission: {behaviors: [{behavior: goal, goals: opposite}]}",
     "opponents[0]", "without a target"),
    (GUARD, "mission.behaviors[1]", "found guard against opponents, and no opponents"),
    ("mission: {max_speed: 1, behaviors: [{behavior: intercept, quarry: opponents}]}",
     "mission.behaviors[0]", "no opponents"),
    ("opponents: [{}]\nknowledge: {}\n" + GUARD, "mission.behaviors[1]", "with knowledge or communication"),
    ("opponents: [{}]\nmission: {behaviors: [{behavior: guard, distance: 0}]}",
     "mission.behaviors[0].distance", "more than 0"),
    ("opponents: [{}]\nmission: {behaviors: [{behavior: guard, alert: 0}]}",
     "mission.behaviors[0].alert", "more than 0"),
    ("opponents: [{}]\nmission: {max_speed: 1, behaviors: [{behavior: intercept, quarry: robots}]}",
     "mission.behaviors[0].quarry", "opponents"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "path", "words"), WRONG)
def test_each_fault_is_one_message_with_its_place(text: str, path: str, words: str) -> None:
    assert_one_fault(text, path, words)


def test_a_right_one_reads_back_the_same() -> None:
    text = (
        "opponents: [{count: 2, policy: weave}, {name: late, policy: {policy: avoid, sight: 2}, start: 4}]\n"
    )
    scenario = parse_scenario(text + GUARD)
    assert parse_scenario(dump_scenario(scenario)) == scenario
