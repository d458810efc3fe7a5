"""Wrong tables `teams`, and what does not go with teams: one fault each, with its place."""

import pytest

from escort_mj.scenario import dump_scenario, parse_scenario
from tests.scenario.faults import assert_one_fault

ONE = "{name: one, robots: [1, 2, 3], targets: [{name: a}]}"
TWO = "{name: two, robots: [4, 5], targets: [{name: b, position: [20, 0]}]}"
BOTH = f"target: null\nteams: [{ONE}, {TWO}]\n"


def with_two(table: str) -> str:
    """The first team with another one in place of the second."""
    return f"target: null\nteams: [{ONE}, {table}]\n"


def behaving(behavior: str) -> str:
    return BOTH + f"mission: {{behaviors: [{behavior}]}}"


def joining(escorts: str, b: str = "", c: str = "", radii: str = "") -> str:
    """Two targets of the second team, 1 m apart, that change teams."""
    b, c = f"{{name: b, position: [20, 0], escorted_by: [{b}]}}", f"escorted_by: [{c or escorts}]"
    targets = f"[{b}, {{name: c, position: [21, 0], {c}}}]"
    return with_two(f"{{name: two, robots: [4, 5], radius: 5, radii: [{radii}], targets: {targets}}}")


B = "targets: [{name: b, position: [20, 0]}]"
WRONG = [
    (with_two(f"{{name: 'a b', robots: [4, 5], {B}}}"), "teams[1].name", "letters, digits"),
    (with_two(f"{{name: one, robots: [4, 5], {B}}}"), "teams[1].name", "found the name one twice"),
    (with_two(f"{{name: two, robots: [], {B}}}"), "teams[1].robots", "at least 1"),
    (with_two(f"{{name: two, robots: [4, 0], {B}}}"), "teams[1].robots[1]", "more than 0"),
    (with_two(f"{{name: two, robots: [4, 5, 6], {B}}}"), "teams[1].robots[2]", "allowed are 1 to 5"),
    (with_two(f"{{name: two, robots: [4, 5, 3], {B}}}"), "teams[1].robots[2]", "it is in team one"),
    (with_two(f"{{name: two, robots: [4], {B}}}"), "teams", "found robot 5 in no team"),
    (with_two("{name: two, robots: [4, 5], targets: []}"), "teams[1].targets", "at least 1"),
    (with_two("{name: two, robots: [4, 5], targets: [{}]}"), "teams[1].targets[0].name", "missing"),
    (with_two("{name: two, robots: [4, 5], targets: [{name: a, position: [20, 0]}]}"),
     "teams[1].targets[0].name", "found a again"),
    (with_two("{name: two, robots: [4, 5], targets: [{name: b, position: [20]}]}"),
     "teams[1].targets[0].position", "expected 2, as axes says"),
    (with_two("{name: two, robots: [4, 5], targets: [{name: b, position: [20/t, 0]}]}"),
     "teams[1].targets[0].position[0]", "has no finite"),
    (with_two("{name: two, robots: [4, 5], targets: [{name: b, position: [20, 0], radius: 0}]}"),
     "teams[1].targets[0].radius", "at least"),
    (with_two("{name: two, robots: [4, 5], targets: [{name: b, position: [20, 0], body: {gain: 1000}}]}"),
     "teams[1].targets[0].body.gain", "at most 500"),
    (with_two(f"{{name: two, robots: [4, 5], radius: 2, {B}}}"),
     "teams[1].radius", "expected at least 2.5 m"),
    (with_two("{name: two, robots: [4, 5], targets: [{name: b, position: [20, 0]}, "
              "{name: c, position: [20, t]}]}"), "teams[1].radius", "b is 15 m from the middle at 30 s"),
    (with_two(f"{{name: two, robots: [4, 5], demand: [{{robots: 0}}], {B}}}"),
     "teams[1].demand[0].robots", "more than 0"),
    (with_two(f"{{name: two, robots: [4, 5], demand: [{{robots: 5}}], {B}}}"),
     "teams", "found demands of 6 robots at 0 s"),
    (with_two(f"{{name: two, robots: [4, 5], demand: [{{after: 40, robots: 1}}], {B}}}"),
     "teams[1].demand[0].after", "the run ends at 30 s"),
    (with_two(f"{{name: two, robots: [4, 5], demand: [{{after: 4, robots: 1}}, {{robots: 2}}], {B}}}"),
     "teams[1].demand[1].after", "in order of time"),
    (joining("{team: tow}"), "teams[1].targets[1].escorted_by[0].team", 'did you mean "two"?'),
    (joining("{after: 2}"), "teams[1].targets[1].escorted_by[0].team", "missing"),
    (joining("{after: -2, team: one}"), "teams[1].targets[1].escorted_by[0].after", "at least 0"),
    (joining("{after: 4, team: null}, {after: 4, team: two}"),
     "teams[1].targets[1].escorted_by[1].after", "found 4 s after 4 s; expected entries in order of time"),
    (joining("{after: 40, team: null}"), "teams[1].targets[1].escorted_by[0].after", "the run ends at 30 s"),
    (joining("{after: 8, team: one}"), "teams[0].radius", "a is 10.5 m from the middle at 8 s"),
    (joining("{team: one}, {after: 9, team: two}"), "teams[0].radius", "a is 10.5 m from the middle at 0 s"),
    (joining("{after: 2, team: null}", b="{after: 9, team: null}"), "teams[1].targets",
     "found no target of team two from 9 s on; expected one at least, at every time"),
    (joining("{after: 2, team: two}", b="{team: null}, {after: 3, team: two}", c="{team: null}"),
     "teams[1].targets", "found no target of team two from 0 s on"),
    (joining("", radii="{after: 3, radius: 2}"), "teams[1].radii[0].radius", "at least 3 m: b is 0.5 m"),
    (joining("", radii="{after: 3, radius: 5}, {after: 2, radius: 6}"), "teams[1].radii[1].after",
     "found 2 s after 3 s"),
    (joining("", radii="{radius: 2}"), "teams[1].radii[0].after", "missing"),
    (with_two(f"{{name: two, robot: [4, 5], robots: [4, 5], {B}}}"),
     "teams[1].robot", 'did you mean "robots"?'),
    (f"teams: [{ONE}, {TWO}]\ntarget: {{position: [0, 9]}}", "target", "expected target: null"),
    (f"axes: 4\nrobots: {{count: 5}}\ntarget: null\nteams: [{ONE.replace('3]', '3, 4, 5]')}]", "teams[0]",
     "in 2 or 3"),
    (with_two(f"{{name: two, robots: [4, 5], controller: smc, {B}}}"), "teams[1].controller",
     'did you mean "asmc"?'),
    (with_two(f"{{name: two, robots: [4, 5], controller: 5, {B}}}"), "teams[1].controller",
     "expected a name or a table of keys"),
    (with_two(f"{{name: two, robots: [4, 5], controller: {{law: asmc, slop: 3}}, {B}}}"),
     "teams[1].controller.slop", 'did you mean "slope"?'),
    (with_two(f"{{name: two, robots: [4, 5], controller: {{slope: -3}}, {B}}}"),
     "teams[1].controller.slope", "expected more than 0"),
    (with_two(f"{{name: two, robots: [4, 5], controller: {{gains: best}}, {B}}}")
     + "controller: {gains: auto}", "teams[1].controller.gains", "allowed is auto"),
    (with_two(f"{{name: two, robots: [4, 5], controller: {{law: super_twisting, gains: auto}}, {B}}}"),
     "teams[1].controller.gains", "found auto with the law super_twisting"),
    (BOTH + "clutter: {count: 1, low: [8, 8], high: [12, 12]}", "clutter", "with teams"),
    (BOTH + "sensing: {target_position: {noise: 0.1}}", "sensing.target_position", "expected none"),
    (with_two("{name: two, robots: [4, 5], targets: [{name: b, position: [20, 0], policy: straight}]}"),
     "teams[1].targets[0].policy", "an opponent's policy"),
    (with_two("{name: two, robots: [4, 5], targets: [{name: b, position: [20 + t, 0], policy: flee}]}"),
     "teams[1].targets[0].position[0]", "found an expression in t"),
    (with_two("{name: two, robots: [4, 5], targets: [{name: b, position: [20, 0], "
              "policy: {policy: follow, leader: c}}]}"), "teams[1].targets[0].policy.leader", 'found "c"'),
    (behaving("chords"), "mission.behaviors[0]", "one formation of all robots"),
    (behaving("{behavior: surface, radius: 4}"), "mission.behaviors[0]", "each team has its radius"),
    (behaving("{behavior: surface, fit: true}"), "mission.behaviors[0]", "each team has its radius"),
    (BOTH + "mission: {supervisor: [{team: tow, behaviors: [surface]}]}", "mission.supervisor[0].team",
     'did you mean "two"?'),
    ("mission: {supervisor: [{team: two, behaviors: [surface]}]}", "mission.supervisor[0].team", "no teams"),
    (BOTH + "mission: {supervisor: [{when: {quantity: target_obstacle_distance, below: 1}, behaviors: "
            "[surface]}]}", "mission.supervisor[0].when.quantity", "are obstacles themselves"),
    (BOTH + "expect: [{metric: radius_error_max, at_most: 1, team: three}]", "expect[0].team",
     "allowed are one or two"),
    (BOTH + "expect: [{metric: radius_error_max, at_most: 1}]", "expect[0]", "give team: one or two"),
    (BOTH + "expect: [{settled: 1, by: 2}]", "expect[0]", "give team: one or two"),
    (BOTH + "expect: [{metric: energy, at_most: 1, team: one}]", "expect[0].team", "is of all robots"),
    ("expect: [{settled: 1, by: 2, team: one}]", "expect[0].team", "no teams"),
]  # fmt: skip


TOLD = BOTH + "communication: {}\nknowledge: {target: {robots: [3, 4]}}\n"
KNOWING = [
    (BOTH + "knowledge: {target: {robots: [1, 2]}}", "knowledge.target.robots",
     "found no robot of team two; expected one at least: 4 or 5"),
    (BOTH + "knowledge: {target: {robots: [1, 6]}}\ncommunication: {}", "knowledge.target.robots",
     "found robot 6; allowed are 1 to 5"),
    (BOTH + "knowledge: {target: {robots: [1, 4], measures: [range]}}", "knowledge.target.measures",
     "predict needs position and velocity"),
    (BOTH + "knowledge: {target: {field_of_view: 2}}", "knowledge.target.field_of_view", "has no heading"),
    (TOLD + "sensing: {target_position: {noise: 0.1}}", "sensing.target_position", "knowledge.target has"),
    (TOLD + "sensing: {target_velocity: {delay: 0.1}}", "sensing.target_velocity", "none with teams"),
    (TOLD + "mission: {behaviors: [chords]}", "mission.behaviors[0]", "one formation of all robots"),
    (TOLD + "mission: {behaviors: [{behavior: surface, fit: true}]}", "mission.behaviors[0]",
     "each team has its radius"),
    (TOLD + "mission: {behaviors: [{behavior: vertices, assignment: auction}]}", "mission.behaviors[0]",
     "expected nearest"),
    (behaving("{behavior: vertices, assignment: auction}"), "mission.behaviors[0]", "expected nearest"),
    (TOLD + "mission: {behaviors: [{behavior: formation, offsets: [[1, 0], [0, 1], [2, 0], "
            "[0, 2], [3, 0]]}]}", "mission.behaviors[0]", "give position"),
    (BOTH + "knowledge: {}\nmission: {behaviors: [{behavior: avoid_obstacles, teammates: heard}, surface]}",
     "mission.behaviors[0].teammates", "without communication"),
    (BOTH + "communication: {graph: {edges: [[1, 4], [2, 6]]}}", "communication.graph.edges[1]", "robot 6"),
    (BOTH + "communication: {blackouts: [{groups: [[1, 2], [2, 4]]}]}", "communication.blackouts[0].groups",
     "found robot 2 in two groups"),
    (TOLD + "expect: [{metric: estimate_error_rms, at_most: 1}]", "expect[0]", "give team: one or two"),
    (TOLD + "expect: [{metric: disconnected_time, at_most: 1}]", "expect[0]", "give team: one or two"),
    (TOLD + "expect: [{metric: message_rate, at_least: 1, team: one}]", "expect[0].team", "is of all robots"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "path", "words"), [*WRONG, *KNOWING])
def test_each_fault_is_one_message_with_its_place(text: str, path: str, words: str) -> None:
    assert_one_fault(text, path, words)


def test_a_right_one_reads_back_the_same() -> None:
    expected = "expect: [{settled: 1, by: 2, team: two}]\nmission: {radius: 4, behaviors: [surface]}\n"
    scenario = parse_scenario(BOTH + expected)
    assert parse_scenario(dump_scenario(scenario)) == scenario
