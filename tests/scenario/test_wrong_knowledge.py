"""Wrong tables `knowledge`, `communication` and `sensing.lidar`: one clear fault each."""

import pytest

from escort_mj.errors import ScenarioError
from escort_mj.scenario import dump_scenario, parse_scenario

HEAD = "duration: 30\n"

# What is wrong, where the fault is, and words of the message.
WRONG = [
    ("knowledge: {target: {robots: [6]}}", "knowledge.target.robots", "found robot 6; allowed are 1 to 5"),
    ("knowledge: {target: {robots: [0]}}", "knowledge.target.robots[0]", "at least 1"),
    ("knowledge: {target: {robots: [1, 1]}}", "knowledge.target.robots", "expected each robot once"),
    ("knowledge: {target: {robots: []}}", "knowledge.target.robots", "at least 1"),
    ("knowledge: {target: {rate: 30}}", "knowledge.target.rate", "29.4117647 or 31.25"),
    ("knowledge: {target: {rate: 1000}}", "knowledge.target.rate", "0.5 steps of 0.002 s apart"),
    ("knowledge: {target: {range: -1}}", "knowledge.target.range", "more than 0"),
    ("knowledge: {target: {field_of_view: 7}}", "knowledge.target.field_of_view", "less than 6.28"),
    (
        "knowledge: {target: {robots: [2, 3], field_of_view: 2}}\nrobots: {kind: quadrotor, overrides: "
        "[{robot: 3, kind: point_mass}]}",
        "knowledge.target.field_of_view",
        "robot 3 is a point_mass, which has no heading",
    ),
    ("knowledge: {target: {measures: [speed]}}", "knowledge.target.measures[0]", "position, velocity, range"),
    (
        "knowledge: {target: {measures: [range]}}",
        "knowledge.target.measures",
        "predict needs position and vel",
    ),
    (
        "knowledge: {estimator: kalman, target: {measures: [velocity]}}",
        "knowledge.target.measures",
        "kalman needs position or range or bearing",
    ),
    (
        "knowledge: {target: {measures: [position, position, velocity]}}",
        "knowledge.target.measures",
        "each once",
    ),
    ("knowledge: {target: {noise: {position: -1}}}", "knowledge.target.noise.position", "at least 0"),
    ("knowledge: {target: {noise: {bearing: 1}}}", "knowledge.target.noise.bearing", "at most 0.5"),
    ("knowledge: {target: {dropout: 1}}", "knowledge.target.dropout", "less than 1"),
    ("knowledge: {target: {outliers: {share: 0.1}}}", "knowledge.target.outliers.size", "missing"),
    ("knowledge: {estimator: kalmann}", "knowledge.estimator", 'did you mean "kalman"?'),
    ("knowledge: {estimator: {estimator: kalman, noise: 0}}", "knowledge.estimator.noise", "more than 0"),
    ("knowledge: {estimator: {estimator: kalman, model: jerk}}", "knowledge.estimator.model", "velocity"),
    ("knowledge: {estimator: {estimator: consensus, share: 1}}", "knowledge.estimator.share", "less than 1"),
    ("knowledge: {initial: {position: -1}}", "knowledge.initial.position", "at least 0"),
    ("knowledge: {targets: {}}", "knowledge.targets", 'did you mean "target"?'),
    (
        "mission: {behaviors: [avoid_obstacles, {behavior: vertices, assignment: auction}, surface]}",
        "mission.behaviors[1].assignment",
        "without communication, by which robots bid; expected nearest",
    ),
    ("communication: {graph: star}", "communication.graph", "complete"),
    ("communication: {graph: {nearest: 5}}", "communication.graph.nearest", "at most 4"),
    ("communication: {graph: {edges: [[1, 6]]}}", "communication.graph.edges[0]", "found robot 6"),
    ("communication: {graph: {edges: [[2, 2]]}}", "communication.graph.edges[0]", "each robot once"),
    ("communication: {rate: 70}", "communication.rate", "expected a whole number of steps"),
    ("communication: {range: 0}", "communication.range", "more than 0"),
    ("communication: {delay: [0.2, 0.1]}", "communication.delay", "the least one first"),
    ("communication: {delay: -0.1}", "communication.delay", "at least 0"),
    ("communication: {delay: 5}", "communication.delay", "messages of each robot on their way"),
    (
        "communication: {graph: {edges: [[1, 2]]}, delay: 5}",
        "communication.delay",
        "messages of each robot on their way",
    ),
    ("communication: {loss: 1}", "communication.loss", "less than 1"),
    ("communication: {loss: {mean: 0.2}}", "communication.loss.burst", "is missing: mean number"),
    ("communication: {loss: {mean: 0.9, burst: 1}}", "communication.loss.burst", "expected at least 9, as"),
    ("communication: {timeout: 0}", "communication.timeout", "more than 0"),
    (
        "communication: {blackouts: [{after: 9, before: 8}]}",
        "communication.blackouts[0].before",
        "more than after",
    ),
    ("communication: {blackouts: [{robots: [7]}]}", "communication.blackouts[0].robots", "found robot 7"),
    (
        "communication: {blackouts: [{groups: [[1, 2], [2, 3]]}]}",
        "communication.blackouts[0].groups",
        "found robot 2 in two groups",
    ),
    (
        "communication: {blackouts: [{robots: [1], groups: [[2], [3]]}]}",
        "communication.blackouts[0]",
        "found robots and groups",
    ),
    ("sensing: {lidar: {rays: 4}}", "sensing.lidar.rays", "at least 8"),
    ("sensing: {lidar: {range: 1}}", "sensing.lidar.range", "expected at least 2.2 m"),
    ("sensing: {lidar: {rate: 30}}", "sensing.lidar.rate", "29.4117647 or 31.25"),
    ("axes: 4\nsensing: {lidar: {}}", "sensing.lidar", "expected null, or axes 2 or 3"),
    (
        "sensing: {lidar: {}}\nmission: {behaviors: [avoid_obstacles, {behavior: surface, fit: true}]}",
        "mission.behaviors[1].fit",
        "which a lidar does not show",
    ),
    (
        "communication: {}\nmission: {behaviors: [avoid_obstacles, chords, surface]}",
        "mission.behaviors[1]",
        "chords to robots that it may not hear",
    ),
    (
        "communication: {}\ntarget: null\nmission: {behaviors: [{behavior: goal, goals: opposite}]}",
        "communication",
        "",
    ),
    (
        "mission: {behaviors: [{behavior: avoid_obstacles, teammates: heard}, surface]}",
        "mission.behaviors[0].teammates",
        "found heard without communication",
    ),
    (
        "communication: {}\nmission: {behaviors: [{behavior: avoid_obstacles, teammates: herd}, surface]}",
        "mission.behaviors[0].teammates",
        'found "herd"; allowed are true, false or heard',
    ),
    (
        "communication: {}\nrobots: {force_limit: null}\n"
        "mission: {behaviors: [{behavior: avoid_obstacles, teammates: heard}, surface]}",
        "mission.behaviors[0].teammates",
        "with neither mission.max_speed nor robots.force_limit",
    ),
    (
        "communication: {range: 2, measure: surface}\nmission: {behaviors: [{behavior: avoid_obstacles, "
        "safe_distance: 2.1, measure: surface, teammates: heard}, surface]}",
        "communication.range",
        "expected at least 2.1 m",
    ),
    (
        "knowledge: {}\nrobots: {count: 1}\nmission: {behaviors: [{behavior: formation, offsets: [[1, 0]]}]}",
        "mission.behaviors[0]",
        "each robot knows the target by itself",
    ),
]


def faults_of(text: str):
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text)
    return caught.value.faults


@pytest.mark.parametrize(("text", "key", "words"), WRONG, ids=[text for text, _, _ in WRONG])
def test_one_clear_fault(text: str, key: str, words: str) -> None:
    (fault,) = faults_of(HEAD + text + "\n")
    assert (fault.key, words in fault.message) == (key, True), (fault.key, fault.message)


RIGHT = [
    "knowledge: {}",
    "knowledge: {estimator: {estimator: kalman, model: acceleration}, target: {measures: [range, bearing]}}",
    "knowledge: {target: {robots: [2], field_of_view: 2, hidden_by_teammates: true}}\nrobots: {overrides: "
    "[{robot: 2, kind: quadrotor}]}",
    "communication: {blocked: true}",
    "sensing: {lidar: {rays: 90, range: 5, noise: 0.01, rate: 20}}",
    "communication: {graph: ring, range: 4, measure: surface, rate: 10, delay: [0, 0.1], jitter: 0.02}",
    "communication: {graph: {nearest: 2}, loss: {mean: 0.3, burst: 4}, timeout: null}",
    "communication: {blackouts: [{after: 1, before: 2}, {robots: [1]}, {groups: [[1, 2], [3, 4]]}]}",
]


@pytest.mark.parametrize("text", RIGHT)
def test_right_tables_read_back_the_same(text: str) -> None:
    scenario = parse_scenario(HEAD + text + "\n")
    assert parse_scenario(dump_scenario(scenario)) == scenario
