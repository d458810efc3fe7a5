import math
from typing import Any

import numpy as np
import pytest

from escort_mj import Scenario, run
from escort_mj.measuring import measure
from tests.metrics.motions import TIME
from tests.metrics.test_opponents import fates

STEP = 0.002


def recomputed_target_energy(again: Any) -> float | None:
    """Over a mission of `test_recomputed`: by Newton's law, and in the last step by the law of the drive."""
    target = again.case.keys.get("target", {})
    if "body" not in target:
        return None
    mass, x, v = target["body"]["mass"], again.target, again.get("target_velocity")
    t = float(again.time[-1])
    path, speed = [0.4 * np.sin(3 * t), 0.2 * t], [1.2 * np.cos(3 * (t + STEP)), 0.2]
    last = speed + target["body"]["gain"] * (path - x[-1]) - v[-1]
    force = mass * np.vstack([np.diff(v, axis=0), last]) / STEP
    return float(STEP * np.abs((force * v).sum(axis=1))[1:].sum())


def recomputed_opponents_energy(again: Any) -> float | None:
    """Likewise of bodies of 1 kg; in the last step, the one that is still on its way has its full speed."""
    total = None
    for (_, end), start, o in zip(fates(again), (0.0, 0.0, 2.5), range(3), strict=False):
        v = np.diff(again.places[:, o], axis=0, prepend=again.places[:1, o]) / STEP
        force = np.diff(v, axis=0, append=v[-1:]) / STEP
        work = STEP * np.abs((force * v).sum(axis=1))
        first = int(np.searchsorted(again.time, start - 1e-9))
        total = (total or 0.0) + float(work[max(first, 1) : None if end < 0 else end].sum())
    return total


def test_the_work_of_a_constant_force_is_the_kinetic_energy() -> None:
    """3 N push 2 kg to 1 m/s in 2/3 s; steps add up to half a step's work more than m v^2 / 2."""
    trace = run(Scenario(
        duration=1.0, recording={"rate": 500}, target={"radius": 0.3}, robots={"count": 1},
        mission={"radius": 5.0, "behaviors": ["surface"]},
        opponents=[
            {"positions": [[20.0, 0.0]], "policy": "straight", "body": {"mass": 2.0, "force_limit": 3.0}},
            {"name": "late", "positions": [[0.0, 20.0]], "start": 100},
        ],
    )).trace  # fmt: skip
    assert trace["mover"].values.tolist() == ["opponent_1", "late_1"]
    work, time, full = trace["mover_work"].values, trace["time"].values, 2.0 / 3.0
    for moment in (0.2, 0.5, 0.66):
        step = int(np.searchsorted(time, moment - 1e-9))
        speed = 1.5 * step * STEP  # m/s, at the beginning of the step
        assert work[step, 0] == pytest.approx(0.5 * 2.0 * speed**2 + 0.5 * 3.0 * STEP * speed, rel=1e-9)
    after = time > full + 2 * STEP
    assert np.ptp(work[after, 0]) < 1e-12 and work[-1, 0] == pytest.approx(1.0, rel=STEP / full)
    assert not work[:, 1].any()


@pytest.mark.parametrize(("keys", "metric", "reason"), [
    ({}, "target_energy", "no force drives the target"),
    ({"target": None, "robots": {"count": 1},
      "mission": {"behaviors": [{"behavior": "goal", "goals": [[1, 0]]}]}},
     "target_energy", "there is no target"),
    ({}, "opponents_energy", "there are no opponents"),
])  # fmt: skip
def test_without_a_force_there_is_no_energy(keys: dict[str, Any], metric: str, reason: str) -> None:
    found = run(Scenario(duration=0.1, **keys)).metrics[metric]
    assert (found["value"], found["reason"]) == (None, reason)


def test_the_energy_of_targets_of_teams_is_their_sum() -> None:
    teams = [
        {"name": name, "robots": [robot], "radius": 3.0, "targets": [
            {"name": f"of_{name}", "position": [f"{x} + sin(t)", 0], "body": {"mass": 2.0}}]}
        for name, robot, x in (("left", 1, -10), ("right", 2, 10))
    ]  # fmt: skip
    found = run(Scenario(
        duration=1, target=None, teams=teams, robots={"positions": [[-10, 3], [10, 3]]},
        mission={"behaviors": ["surface"]}, obstacles=[{"motion": {"position": ["t", 20]}}],
    ))  # fmt: skip
    lost = 2.0 * 2.0 * 0.5 * (1.0 - np.cos(1.0) ** 2)  # both slow down from 1 m/s to cos(1) m/s
    assert found.values["target_energy"] == pytest.approx(lost, rel=0.01)
    assert found.trace["mover"].values.tolist() == ["obstacle_1", "of_left", "of_right"]


class TestTotals:
    """Running totals, written at every physics step, are differenced over the window."""

    def test_a_sine_force_between_samples(self, make_trace):
        # 2 sin(w t) N at 1000 steps a second, sampled once a second: the samples alone would miss it all.
        dt, w = 1e-3, 2.0 * math.pi
        fine = np.arange(0.0, 10.0 + dt / 2.0, dt)
        force = 2.0 * np.sin(w * fine)
        keep = slice(None, None, 1000)
        effort = (dt * np.cumsum(force**2))[keep, None]
        variation = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(force)))])[keep, None]
        trace = make_trace(fine[keep], effort=effort, force_variation=variation)
        assert measure("force_rms", trace).value == pytest.approx(math.sqrt(2.0), rel=1e-9)
        assert measure("chattering", trace).value == pytest.approx(8.0, rel=1e-4)  # 4 amplitudes a period
        assert measure("force_rms", trace, after=3.0, before=5.0).value == pytest.approx(math.sqrt(2.0))

    def test_a_window_counts_what_was_gained_in_it(self, make_trace):
        ramp = np.stack([TIME, 3.0 * TIME], axis=1)
        trace = make_trace(TIME, robots=2, work=ramp, saturated_time=ramp / 4.0, effort=ramp)
        assert measure("energy", trace).value == pytest.approx(40.0)
        assert measure("energy", trace, after=4.0, before=6.0).value == pytest.approx(8.0)
        assert measure("saturated_share", trace, after=4.0).value == pytest.approx(0.5)
        assert measure("force_rms", trace, before=5.0).value == pytest.approx(math.sqrt(2.0))

    @pytest.mark.parametrize("name", ["force_rms", "chattering", "energy", "saturated_share"])
    def test_one_sample_spans_no_time(self, make_trace, name):
        found = measure(name, make_trace([0.0]))
        assert (found.value, found.reason) == (None, "the window holds a single sample")

    def test_windows_add_up(self, make_trace):
        total = np.cumsum(np.random.default_rng(1).random((501, 2)), axis=0)
        trace = make_trace(TIME, robots=2, work=total)
        parts = [measure("energy", trace, a, b).value for a, b in ((0.0, 3.0), (3.0, 7.5), (7.5, None))]
        assert sum(parts) == pytest.approx(measure("energy", trace).value, rel=1e-12)
