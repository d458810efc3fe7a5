"""Wrong missions and failures: one fault each, named with its place, its key and what is allowed."""

import pytest

from tests.scenario.test_wrong_scenarios import fault_of

# What is wrong, the scenario, the place and key, and words of the message.
WRONG = [
    (
        "number for a boolean",
        "mission: {target_feedforward: 1}",
        "1:31: mission.target_feedforward: ",
        "true or false",
    ),
    (
        "NaN",
        "mission: {radius: .nan}\n",
        "1:19: mission.radius: ",
        "found NaN (not a number); expected a finite",
    ),
    (
        "a boundary without a direction",
        "mission: {behaviors: [{behavior: boundary, point: [0, -6], normal: [0, 0]}, surface]}\n",
        "1:68: mission.behaviors[0].normal: ",
        "found [0.0, 0.0]; expected a vector of some length",
    ),
    ("infinity", "mission: {max_speed: .inf}\n", "1:22: mission.max_speed: ", "found infinity"),
    (
        "failure of a robot that is not there",
        "robots:\n  count: 5\n  failures: [{robot: 6, at: 4}]\n",
        "3:22: robots.failures[0].robot: ",
        "found robot 6; expected 1 to 5",
    ),
    (
        "a robot that fails twice",
        "robots:\n  failures: [{robot: 2, at: 4}, {robot: 2, at: 5}]\n",
        "2:41: robots.failures[1].robot: ",
        "found robot 2 again; failures[0] has it",
    ),
    (
        "failure after the end",
        "duration: 10\nrobots: {failures: [{robot: 2, at: 10}]}\n",
        "2:36: robots.failures[0].at: ",
        "found 10 s; the run ends at 10 s",
    ),
    (
        "failure at no time",
        "robots: {failures: [{robot: 2}]}\n",
        "1:21: robots.failures[0].at: ",
        "is missing: time of the failure",
    ),
    (
        "unknown failure",
        "robots: {failures: [{robot: 2, at: 4, kind: deaf}]}\n",
        "1:45: robots.failures[0].kind: ",
        'allowed are dead, stuck or mad; did you mean "dead"?',
    ),
    (
        "force of dead motors",
        "robots: {failures: [{robot: 2, at: 4, force: 3}]}\n",
        "1:39: robots.failures[0].force: ",
        "is not a key of dead; allowed are kind, robot, at or notice",
    ),
    (
        "madness without a limit",
        "robots: {force_limit: null, failures: [{robot: 2, at: 4, kind: mad}]}\n",
        "1:40: robots.failures[0]: ",
        "robot 2 has no force_limit; give the force of its madness",
    ),
    (
        "nobody stays",
        "robots: {count: 2, failures: [{robot: 2, at: 4}, {robot: 1, at: 4}]}\n",
        "1:30: robots.failures: ",
        "found a failure of each of 2 robots; at least one must stay",
    ),
    (
        "chords in space for five",
        "axes: 3\nmission: {behaviors: [chords, surface]}\nrobots: {failures: [{robot: 2, at: 4}]}\n",
        "2:23: mission.behaviors[0]: ",
        "expected vertices in its place",
    ),
    (
        "unknown behavior",
        "mission: {behaviors: [surfce]}",
        "1:23: mission.behaviors[0]: ",
        'did you mean "surface"?',
    ),
    (
        "nameless behavior",
        "mission: {behaviors: [{gain: 2}]}",
        "1:23: mission.behaviors[0].behavior: ",
        "is missing",
    ),
    (
        "unknown behavior in a table",
        "mission: {behaviors: [{gain: 2, behavior: cords}]}",
        "1:43: mission.behaviors[0].behavior: ",
        'did you mean "chords"?',
    ),
    (
        "unknown parameter of a behavior",
        "mission:\n  behaviors:\n    - {behavior: chords, gian: 2}\n",
        "3:26: mission.behaviors[0].gian: ",
        'is not a key of chords; allowed are behavior, gain or order; did you mean "gain"?',
    ),
    (
        "same behavior twice",
        "mission: {behaviors: [surface, surface]}",
        "1:32: mission.behaviors[1]: ",
        "a second time",
    ),
    ("no behavior", "mission: {behaviors: []}\n", "1:22: mission.behaviors: ", "at least 1"),
    (
        "chords in four axes",
        "axes: 4\nmission: {behaviors: [chords]}\n",
        "2:23: mission.behaviors[0]: ",
        "chords has no even formation of 8 robots in 4 axes; expected vertices or repulsion, which spread",
    ),
    (
        "too close for five robots in four axes",
        "axes: 4\ntarget: {radius: 0.1}\nrobots: {count: 5, radius: 0.8, placement: {within: 20}}\n"
        "mission: {radius: 1}\n",
        "4:19: mission.radius: ",
        "neighbors 1.58 m apart; expected more than their diameter, 1.6 m",
    ),
    (
        "chords in space",
        "axes: 3\nrobots: {count: 5}\nmission: {behaviors: [chords]}\n",
        "3:23: mission.behaviors[0]: ",
        "expected 6 robots, or vertices",
    ),
    (
        "chords of one robot",
        "robots: {count: 1}\nmission: {behaviors: [chords]}\n",
        "2:23: mission.behaviors[0]: ",
        "expected at least 2 robots",
    ),
    (
        "order of chords",
        "mission: {behaviors: [{behavior: chords, order: [1, 2, 3, 4, 4]}]}",
        "1:49: mission.behaviors[0].order: ",
        "expected each robot from 1 to 5 once",
    ),
    (
        "teammates kept too far",
        "mission: {behaviors: [{behavior: avoid_obstacles, teammate_distance: 5.6}, chords]}",
        "1:70: mission.behaviors[0].teammate_distance: ",
        "beyond the formation's neighbors at 5.878 m",
    ),
    (
        "too small a circle",
        "mission: {radius: 0.4, behaviors: [surface]}\nrobots: {positions: [[9, 0]]}",
        "1:19: mission.radius: ",
        "target's body",
    ),
    (
        "too tight a ring",
        "robots: {count: 50, radius: 0.5}\n",
        "1:29: mission.radius: ",
        "their diameter, 1 m",
    ),
]


@pytest.mark.parametrize(
    ("text", "start", "words"), [case[1:] for case in WRONG], ids=[case[0] for case in WRONG]
)
def test_wrong_mission(text: str, start: str, words: str):
    fault = fault_of(text)
    assert fault.startswith(start)
    assert words in fault
    assert "pydantic" not in fault
    assert "Error" not in fault


SUPERVISED = "mission:\n  behaviors: [surface]\n  supervisor:\n  - "
PHASE = "{behaviors: [surface], "

# What is wrong with a phase or a trigger, the scenario's text, and words of the message.
SUPERVISOR = [
    ("always", SUPERVISED + "behaviors: [surface]", "would rule all the time; give after, before or when"),
    ("never", SUPERVISED + PHASE + "after: 9, before: 5}", "never rules: after 9 s and before 5 s"),
    ("too late", SUPERVISED + PHASE + "after: 99}", "found 99 s; the run ends at 30 s"),
    ("twice", SUPERVISED + "{behaviors: [surface, surface], after: 1}", "found surface a second time"),
    ("unknown", SUPERVISED + PHASE + "after: 1, wehn: {}}", 'did you mean "when"?'),
    ("no bound", SUPERVISED + PHASE + "when: {quantity: target_distance}}", "found neither below nor above"),
    (
        "two bounds",
        SUPERVISED + PHASE + "when: {quantity: target_distance, below: 1, above: 2}}",
        "found both below and above",
    ),
    (
        "release inside",
        SUPERVISED + PHASE + "when: {quantity: target_distance, below: 2, release: 1}}",
        "found 1 m; expected at least 2 m",
    ),
    (
        "release inside, above",
        SUPERVISED + PHASE + "when: {quantity: target_distance, above: 2, release: 3}}",
        "found 3 m; expected at most 2 m",
    ),
    (
        "no obstacles",
        SUPERVISED + PHASE + "when: {quantity: obstacle_distance, below: 2}}",
        "found obstacle_distance; there are no obstacles",
    ),
    (
        "no such quantity",
        SUPERVISED + PHASE + "when: {quantity: target_distanse, below: 2}}",
        'did you mean "target_distance"?',
    ),
    (
        "alone",
        "robots: {count: 1}\n" + SUPERVISED + PHASE + "when: {quantity: robot_distance, below: 2}}",
        "found robot_distance; there is one robot",
    ),
    (
        "same name",
        SUPERVISED + PHASE + "after: 1, name: a}\n  - " + PHASE + "after: 2, name: a}",
        "found a again; supervisor[0] has it",
    ),
    ("no dwell", "mission: {trigger: {dwell: -1}}", "found -1"),
    ("dwell", "mission: {trigger: {dwell: 1, longest: 0.5}}", "found 0.5 s; expected more than dwell, 1 s"),
]


@pytest.mark.parametrize(("text", "words"), [case[1:] for case in SUPERVISOR], ids=[c[0] for c in SUPERVISOR])
def test_wrong_phases_and_triggers(text: str, words: str):
    assert words in fault_of(text)
