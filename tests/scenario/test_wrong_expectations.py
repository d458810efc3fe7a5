"""Wrong expectations: one fault each, with its place and what is allowed, before anything runs."""

import pytest

from escort_mj.errors import ScenarioError
from escort_mj.scenario import dump_scenario, parse_scenario

HEAD = "duration: 30\nobstacles: [{position: [9, 9], name: gate}]\nexpect:\n  - "

# What is wrong, the expectation, where the fault is in it, and words of the message.
WRONG = [
    ("{metric: saturated_share, at_most: 1.2}", ".at_most", "saturated_share is always 0 to 1"),
    ("{metric: saturated_share, at_least: 1.01}", ".at_least", "always 0 to 1"),
    ("{metric: contacts, at_least: -1}", ".at_least", "contacts is always 0 or more"),
    ("{metric: contact_force_max, at_most: -1}", ".at_most", "found -1 N; contact_force_max is always 0 N"),
    ("{metric: robot_distance_min, at_least: -0.5}", ".at_least", "always 0 m or more"),
    ("{metric: energy_ratio, at_most: 0.9}", ".at_most", "always 1 or more"),
    ("{metric: radius_error_max, at_most: .nan}", ".at_most", "found NaN (not a number)"),
    ("{metric: radius_error_max, at_most: .inf}", ".at_most", "found infinity"),
    (
        "{metric: radius_error_max, at_most: 1, contacts: none}",
        ".contacts",
        "not a key of metric expectations",
    ),
    (
        "{contacts: [robts, obstacles]}",
        ".contacts[0]",
        "expected a group (robots, target, obstacles, walls, floor)",
    ),
    ("{contacts: [robts, obstacles]}", ".contacts[0]", 'did you mean "robots"?'),
    ("{contacts: [robots, gat]}", ".contacts[1]", 'did you mean "gate"?'),
    ("{contacts: [robot_9, gate]}", ".contacts[0]", "a body (robot_1 to robot_5, gate)"),
    ("{contacts: [robots, walls]}", ".contacts[1]", "found walls; this scenario has none"),
    ("{contacts: [target, floor]}", ".contacts", "a target that is led (without target.body) never meets it"),
    ("{contacts: [target, target]}", ".contacts", "nothing but target, which cannot meet itself"),
    ("{contacts: [robot_1, robot_1]}", ".contacts", "nothing but robot_1"),
    ("{contacts: [gate, floor]}", ".contacts", "expected robots or the target on one side at least"),
    ("{contacts: [robots]}", ".contacts", "found a list of 1; expected none, any, or a list of two"),
    ("{contacts: [robots, 3]}", ".contacts", "found a list of 2; expected none, any, or a list of two"),
    ("{contacts: robots}", ".contacts", 'found "robots"; expected none, any'),
    ("{contacts: null}", ".contacts", "found nothing (null); expected none, any"),
    ("{contacts: none, peak_force: 2}", ".peak_force", "write contacts: any"),
    ("{contacts: none, at_most: 0}", ".at_most", "write contacts: any"),
    ("{contacts: any}", "", "has no bound; give at_most, at_least"),
    ("{contacts: any, at_most: 0.5}", ".at_most", "expected a whole number"),
    ("{contacts: any, peak_force: -1}", ".peak_force", "at least 0"),
    ("{contacts: any, touch_time: soon}", ".touch_time", "expected a number"),
    ("{contacts: any, at_most: 1, at_least: 2}", "", "no value is at least 2 and at most 1"),
    ("{contacts: any, depth: 1}", ".depth", "is not a key of contacts expectations; allowed are"),
    ("{clearance: [robots, gate], at_least: -0.1}", ".at_least", "expected at least 0"),
    ("{clearance: [robots, gate]}", ".at_least", "is missing: minimum"),
    ("{clearance: [robots, gate], at_least: 1, at_most: 2}", ".at_most", "not a key of clearance"),
    ("{clearance: [robots, floor], at_least: 0.1}", ".clearance", "found the floor; clearances are measured"),
    ("{clearance: [obstacles, gate], at_least: 0.1}", ".clearance", "nothing but gate"),
    ("{clearance: none, at_least: 0.1}", ".clearance", 'found "none"; expected a list of two'),
    ("{settled: 0.05}", ".by", "is missing: latest time from which the condition must hold"),
    ("{settled: 0, by: 4}", ".settled", "more than 0"),
    ("{settled: 0.05, by: 40}", ".by", "found 40 s; the run ends at 30 s"),
    ("{settled: 0.05, by: 10, before: 5}", "", "its window is empty: by 10 s and before 5 s"),
    ("{settled: 0.05, by: 10, after: 5}", ".after", "not a key of settled expectations"),
    ("{sanity: [warnigs]}", ".sanity[0]", 'did you mean "warnings"?'),
    ("{sanity: some}", ".sanity", "expected all, or a list of warnings, finite, energy, tunneling"),
    ("{sanity: []}", ".sanity", "at least 1 items"),
    ("{sanity: 3}", ".sanity", "found 3; expected a list"),
    ("{outcome: complete}", ".outcome", 'did you mean "completed"?'),
    ("{outcome: diverged, after: 3}", ".after", "not a key of outcome expectations"),
    ("{contact: none}", "", "does not say what is expected; give one of metric, contacts"),
    ("{contact: none}", "", 'did you mean "contacts"?'),
    ("{at_most: 3}", "", "does not say what is expected"),
    ("3", "", "found 3; expected a table with one of metric, contacts, clearance"),
    ("{contacts: none, xfail: ''}", ".xfail", "expected some text"),
    ("{contacts: none, xfail: true}", ".xfail", "found true; expected text"),
    ("{contacts: none, after: 10, before: 10}", "", "its window is empty"),
    ("{contacts: none, after: -1}", ".after", "at least 0"),
    ("{contacts: none, after: 30}", ".after", "the run ends at 30 s"),
    ("{sanity: all, before: 31}", ".before", "the run ends at 30 s"),
]


def faults_of(text):
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, "s")
    return caught.value.faults


@pytest.mark.parametrize(("expectation", "where", "words"), WRONG)
def test_wrong_expectation(expectation, where, words):
    (fault,) = faults_of(HEAD + expectation + "\n")
    assert (fault.key, fault.line) == (f"expect[0]{where}", 4)
    assert words in fault.message
    assert not any(word in str(fault) for word in ("pydantic", "Error", "union", "_kind"))


def test_all_of_them_at_once_and_in_order():
    alone = [expectation for expectation, _, _ in dict.fromkeys(WRONG)]
    faults = faults_of(HEAD + "\n  - ".join(dict.fromkeys(alone)) + "\n")
    assert [fault.line for fault in faults] == list(range(4, 4 + len(set(alone))))


@pytest.mark.parametrize("metric", ["mass_eigenvalue_min", "skew_residual", "lyapunov_rise"])
def test_the_truth_is_recorded_where_a_metric_needs_it(metric):
    text = f"expect: [{{metric: {metric}, at_most: 5}}]\nrecording: {{truth: TRUTH}}\n"
    (fault,) = faults_of(text.replace("TRUTH", "false"))
    assert (fault.key, fault.line) == ("expect[0].metric", 1)
    assert fault.message.startswith(f"found {metric}, but the truth is not recorded (recording.truth)")
    assert parse_scenario(text.replace("TRUTH", "true")).recording.truth


def test_only_sliding_mode_laws_have_a_lyapunov_function():
    (fault,) = faults_of(
        "expect: [{metric: lyapunov_rise, at_most: 5}]\nrecording: {truth: true}\ncontroller: pd\n"
    )
    assert "not all robots have one sliding-mode law (controller)" in fault.message


def test_two_endings():
    (fault,) = faults_of("expect: [{outcome: diverged}, {outcome: completed}]")
    assert fault.key == "expect[1].outcome" and "expect[0] has one" in fault.message


def test_no_floor_in_space_and_nobody_but_one_robot():
    (fault,) = faults_of("axes: 3\nexpect: [{contacts: [robots, floor]}]")
    assert "found floor; this scenario has none" in fault.message
    text = "robots: {count: 1}\nmission: {behaviors: [surface]}\nexpect: [{contacts: [robots, robots]}]"
    (fault,) = faults_of(text)
    assert "nothing but robot_1" in fault.message


def test_many_obstacles_are_not_all_listed():
    places = ", ".join(f"{{position: [{9 + 2 * k}, 9]}}" for k in range(20))
    (fault,) = faults_of(f"obstacles: [{places}]\nexpect: [{{contacts: [robots, zzz]}}]")
    assert "obstacle_8 ... (12 more)" in fault.message


RIGHT = [
    "{metric: obstacle_clearance_min, at_least: -0.01}",
    "{contacts: none}",
    "{contacts: [robots, gate], peak_force: 3, touch_time: 0.1, at_least: 1}",
    "{contacts: any, impulse: 0, penetration: 0.002, after: 3, before: 30}",
    "{contacts: [robots, floor]}",
    "{clearance: [target, gate], at_least: 0}",
    "{settled: 0.05, by: 10, before: 20}",
    "{sanity: all}",
    "{sanity: [finite, energy], xfail: it is a toy}",
    "{outcome: diverged, xfail: it does not}",
]


@pytest.mark.parametrize("expectation", RIGHT)
def test_right_expectations_read_back_the_same(expectation):
    scenario = parse_scenario(HEAD + expectation + "\n")
    assert parse_scenario(dump_scenario(scenario)) == scenario
