"""The same verdicts at any rate of recording: expectations judge every physics step."""

import re

import numpy as np
import pytest

from escort_mj import Scenario, load_scenario, start
from escort_mj.metrics import METRIC_NAMES
from escort_mj.metrics.tracking import TRACKED
from escort_mj.mission import fly
from escort_mj.recognize import scenario_names, scenarios_folder
from tests.corpus import missions

MISSIONS = missions(__file__)
JUMPING, WAYS = (Scenario(**MISSIONS[name]) for name in ("jumping", "ways"))
PLAIN = '''
from escort_mj.plugins import Expectation, Judgment


class Plain(Expectation):
    """Holds."""

    kind = "plain"
    plain: bool
    """Whether it does."""

    def judge(self, trace):
        return Judgment(self.plain, "done")
'''

LOOK_BACK = ("outcome", "sanity", "tunneling", "kinetic_energy_max")  # their moments are those of samples
LEAP = "{0}*exp(-400*(t-{1})**2)"


def verdicts(scenario, rate):
    """What must not depend on the rate of recording, by the place of the expectation."""
    step, run = scenario.physics.timestep, fly(scenario.replace({"recording.rate": rate}))
    return {
        one.expectation: (
            one.metric,
            one.held,
            None if one.value is None else pytest.approx(one.value, rel=1e-9, abs=1e-12),
            None if one.time is None or one.metric in LOOK_BACK else round(one.time / step),
        )
        for one in run.verdicts
        if "at samples of" not in one.message
    }


def assert_equal(found, reference):
    """Every verdict that does not say that it is of samples is that of all steps."""
    assert found == {place: reference[place] for place in found}


@pytest.mark.parametrize("scenario", [JUMPING, WAYS], ids=["jumping", "ways"])
def test_four_rates_agree(compiled, scenario):
    every = round(1.0 / scenario.physics.timestep)
    reference = verdicts(scenario, every)
    assert len(reference) == len(scenario.expect) + 1
    for rate in (1, 10, 50):
        assert_equal(verdicts(scenario, rate), reference)


@pytest.mark.parametrize(("leap", "held"), [(30.0, True), (100.0, False)])
def test_a_run_diverges_at_any_rate(compiled, leap, held):
    """Between two samples of 1 s the target is 30 or 100 m away, and all is over beyond 40 m."""
    target = {"position": [LEAP.format(leap, 5.37), "0"]}
    scenario = JUMPING.replace(target=target, expect=({"contacts": "none"}, {"sanity": ["finite"]}))
    every = round(1.0 / scenario.physics.timestep)
    reference = verdicts(scenario, every)
    assert reference[None][1] is held and reference[1][1] is held
    for rate in (1, 10, 50):
        assert_equal(verdicts(scenario, rate), reference)


@pytest.mark.slow_cases("diverged")
@pytest.mark.parametrize(("name", "end"), [("unstable", 0.002), ("diverged", 1.688)])
def test_a_run_breaks_off_in_the_same_step_at_any_rate(compiled, name, end):
    scenario = Scenario(**MISSIONS[name], expect=MISSIONS["broken off"])
    reference = verdicts(scenario, 500)
    for rate in (1, 10, 50):
        assert_equal(verdicts(scenario, rate), reference)
        assert fly(scenario.replace({"recording.rate": rate})).trace["time"].values[-1] == pytest.approx(end)


def test_what_strayed_is_named_and_what_did_not_goes_on_with_the_same_bits(compiled):
    far = {"position": [LEAP.format(100.0, 5.37), "0"]}
    run = fly(JUMPING.replace({"recording.rate": 1}, target=far, expect=()))
    assert "m from the target at 5.34 s" in run.message and round(run.trace["time"].values[-1], 2) == 5.34
    near = JUMPING.replace(target={"position": [LEAP.format(39.0, 5.37), "0"]}, expect=())
    coarse, fine = (fly(near.replace({"recording.rate": rate})) for rate in (1, 500))
    assert coarse.passed and fine.passed
    assert np.array_equal(coarse.trace["q"].values, fine.trace["q"].values[::500])
    assert coarse.recording.sizes["episode"] == fine.recording.sizes["episode"]


def test_tunneling_is_of_the_fastest_whenever_they_are(compiled):
    cart = {"name": "cart", "radius": 0.2, "motion": {"position": [LEAP.format(3, 3.7), "8"]}}
    scenario = JUMPING.replace(
        duration=6.0, target={"position": [LEAP.format(3, 2.3), "0"]}, obstacles=(cart,),
        expect=({"metric": "tunneling", "at_most": 0.5}, {"sanity": ["tunneling"]}),
    )  # fmt: skip
    reference = verdicts(scenario, 500)
    for rate in (1, 10, 50):
        assert_equal(verdicts(scenario, rate), reference)


def test_the_tail_of_a_run_begins_in_the_same_step_where_its_duration_is_no_step(compiled):
    """A run of 10.001 s ends in the step at 10 s, and its tail begins at 8 s, not in the step after it."""
    tail = {"metric": "radius_error_mean", "at_most": 0.3, "over": "tail"}
    scenario = JUMPING.replace(
        duration=10.001, expect=(tail, {"metric": "order", "at_most": 0.9, "over": "tail"})
    )
    reference = verdicts(scenario, 500)
    for rate in (1, 10, 50):
        assert_equal(verdicts(scenario, rate), reference)


def test_what_is_changed_on_the_way_counts_from_then_on_at_any_rate(compiled):
    """Robots pass each other at 0.32 m before 0.5 m is asked for, and come to goals while these reach far."""
    behaviors = (
        {"behavior": "avoid_obstacles", "safe_distance": 0.25},
        {"behavior": "goal", "goals": [[3.0, 0.0], [-3.0, 0.6]], "reach": 0.1},
    )
    scenario = WAYS.replace(
        {"mission.behaviors": behaviors, "mission.max_speed": 1.0},
        robots={"positions": [[-3.0, 0.0], [3.0, 0.6]]},
        expect=tuple({"metric": name, "at_most": 0.9} for name in ("safety_agents", "arrival_time")),
    )
    escort = JUMPING.replace(expect=({"metric": "radius_error_max", "at_most": 0.9}, {"settled": 1, "by": 9}))
    found = {}
    for rate in (500, 1, 10):
        mission = start(scenario.replace({"recording.rate": rate})).step(3.862)
        mission.change({"mission.behaviors[0].safe_distance": 0.5, "mission.behaviors[1].reach": 1.5})
        mission.step(2.136).change({"mission.behaviors[1].reach": 0.6})
        other = start(escort.replace({"recording.rate": rate})).step(7.306)
        other.change({"mission.radius": 2.5})
        verdicts = [*mission.step(9.0).run().verdicts, *other.step(9.0).run().verdicts]
        found[rate] = [(one.metric, one.value and round(one.value, 9), one.time) for one in verdicts]
    assert found[1] == found[10] == found[500]


def test_the_worst_is_that_of_all_steps_by_hand(compiled):
    whole = fly(JUMPING.replace({"recording.rate": round(1.0 / JUMPING.physics.timestep)})).trace
    coarse = {one.metric: one for one in fly(JUMPING.replace({"recording.rate": 1})).verdicts}
    time, late = whole["time"].values, whole["time"].values > 5.9999
    away = whole["q"].values - whole["target_position"].values[:, None]
    error = np.abs(np.linalg.norm(away, axis=2) - 4.0)
    assert coarse["radius_error_max"].value == pytest.approx(error[late].max(), rel=1e-12)
    assert coarse["radius_error_max"].time == time[late][error[late].max(axis=1).argmax()]
    inside = late & (time < 9.0001)
    assert coarse["radius_error_mean"].value == pytest.approx(error[inside].mean(), rel=1e-9)
    angle = np.sort(np.arctan2(away[..., 1], away[..., 0]), axis=1)
    gaps = np.diff(angle, append=angle[:, :1] + 2.0 * np.pi, axis=1).max(axis=1)
    assert coarse["largest_gap"].value == pytest.approx(gaps[late].max(), rel=1e-6)
    outside = np.flatnonzero((error > 0.05 * 4.0).any(axis=1))
    assert coarse["settling_time"].value == pytest.approx(time[outside[-1] + 1], abs=1e-9)


def test_what_is_found_from_samples_says_so(compiled):
    scenario = WAYS.replace(expect=({"metric": "stuck", "at_most": 5},))
    assert fly(scenario.replace({"recording.rate": 1})).verdicts[1].message.endswith("at samples of 1 s")
    every = round(1.0 / scenario.physics.timestep)
    assert "samples" not in fly(scenario.replace({"recording.rate": every})).verdicts[1].message


def test_totals_of_robots_that_fail_end_when_the_team_knows(compiled):
    """Robot 2 is counted until 6.5 s, between two samples of 1 s, while a force of 0.1 s acts on it."""
    names = ("force_rms", "energy", "chattering", "saturated_share")
    scenario = WAYS.replace(
        {
            "robots.failures": [{"robot": 2, "at": 6.001, "notice": 0.5}],
            "uncertainty.disturbance": [LEAP.format(30.0, 6.5), "0"],
        },
        expect=tuple({"metric": name, "at_most": 0.5} for name in names),
    )  # fmt: skip
    every = round(1.0 / scenario.physics.timestep)
    reference = verdicts(scenario, every)
    for rate in (1, 10, 50):
        assert_equal(verdicts(scenario, rate), reference)


def test_tracking_errors_name_robots_that_they_leave_out(compiled):
    errors = [
        name for name in METRIC_NAMES if re.match(r"(true_)?(tracking_|velocity_)?error_(rms|max)$", name)
    ]
    failing = {"robots.failures": [{"robot": 2, "at": 1.0}], "duration": 2.0}
    run = fly(WAYS.replace(failing, expect=tuple({"metric": name, "at_most": 9.0} for name in errors)))
    assert len(errors) == 6 and all(
        "; without robot 2, which failed" in one.message for one in run.verdicts[1:]
    )


def test_the_first_opponent_that_comes_through_is_the_same(compiled):
    scenario = Scenario(**MISSIONS["breached"])
    found = {rate: fly(scenario.replace({"recording.rate": rate})).verdicts[1] for rate in (1, 10, 500)}
    assert len({(one.value, one.who, one.time) for one in found.values()}) == 1
    assert found[1].who == "opponent_3" and "then opponent_1 by 4.00 s" in found[1].message
    assert "then opponent_2 at 3.7" in found[500].message


def test_so_does_what_a_plugin_judges_without_a_value(compiled, tmp_path):
    (tmp_path / "plain.py").write_text(PLAIN)
    path = tmp_path / "plain.yaml"
    path.write_text("duration: 1\nplugins: [plain.py]\nexpect: [{plain: true}, {plain: false}]\n")
    found = [one.message for one in fly(load_scenario(path)).verdicts[1:]]
    assert len(found) == 2 and all(one.endswith("done; at samples of 0.02 s") for one in found)


def test_a_radius_that_grows_is_the_one_to_keep(compiled):
    run = fly(Scenario(**MISSIONS["growing"]))
    assert run.passed
    assert np.allclose(run.trace["kept_radius"].values, (3.0 + 0.1 * run.trace["time"].values)[:, None])


@pytest.mark.slow
def test_a_radius_that_grows_far_is_no_divergence_and_no_error(compiled):
    surface = {"behavior": "surface", "radius": "1 + 1.5*t"}
    mission = {"radius": 1.0, "max_speed": 5.0, "behaviors": ["vertices", surface]}
    robots = {"count": 3, "velocities": [[3.0, 0.0]] * 3, "force_limit": 4.0}
    far = Scenario(duration=20.0, robots=robots, mission=mission)
    run = fly(far)
    assert run.message == "completed 20 s"
    assert (
        np.abs(run.trace["e"].values).max() > TRACKED
    )  # of the radius at the start, never of that of the time
    assert run.measures["tracking_time"].value == 0.0
    adrift = {"robots.velocities": [[9.0, 0.0]] * 3, "robots.force_limit": 1e-6}
    assert fly(far.replace(adrift)).outcome == "completed"  # 180 m of 310 m
    surface["radius"] = "1 + 0.15*t"
    assert fly(far.replace({**adrift, "mission.behaviors": ("vertices", surface)})).outcome == "diverged"


@pytest.mark.slow
@pytest.mark.parametrize("name", [n for n in scenario_names(scenarios_folder()) if "crowd" not in n][:40])
def test_shipped_scenarios_have_the_same_verdicts_at_four_rates(compiled, name):
    scenario = load_scenario(name)
    every = round(1.0 / scenario.physics.timestep)
    if not scenario.expect or scenario.duration > 130.0:
        pytest.skip("nothing is judged, or it takes long")
    reference = verdicts(scenario.replace({"recording.truth": False}), every)
    for rate in (1, 10, 50):
        assert_equal(verdicts(scenario.replace({"recording.truth": False}), rate), reference)
