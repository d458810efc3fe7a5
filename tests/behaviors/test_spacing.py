"""Spacing by two neighbors: the kernel against its twin, and the even figure from any start."""

from dataclasses import replace

import pytest

import escort_mj
from escort_mj import Scenario
from escort_mj.behaviors import Repulsion, Surface
from escort_mj.behaviors.connect import Connect
from escort_mj.behaviors.spacing import Spacing
from escort_mj.control.outer_loops import SetBased
from escort_mj.knowledge.sight import SightNoise, TargetSight
from escort_mj.measuring import measure
from escort_mj.radios import Periodic
from escort_mj.radios.radio import Loss, Nearest
from escort_mj.sensing.sensors import Sensors
from escort_mj.sensors import Plain
from tests.control.twins import AVOID, compare, mission

STACKS = [
    (AVOID, Spacing(), Surface()),
    (AVOID, Repulsion(), Surface()),
    (Connect(distance=3.0), Spacing(gain=0.5), Surface()),
]
NEAR = {"behavior": "avoid_obstacles", "safe_distance": 0.8}
SEEN = TargetSight(noise=SightNoise(position=0.05, velocity=0.1))
NEAREST = Periodic(
    graph=Nearest(nearest=3), rate=250.0, delay=(0.0, 0.006), loss=Loss(mean=0.375, burst=2.0), timeout=0.02
)


@pytest.mark.crossed
@pytest.mark.parametrize("stack", STACKS, ids=lambda stack: "-".join(each.behavior for each in stack))
@pytest.mark.parametrize("knows", ["all", "sight", "messages"])
@pytest.mark.parametrize("axes", [2, 3])
def test_kernel_and_twin(axes: int, knows: str, stack) -> None:
    setup, q, v = mission(axes, 4)
    setup = replace(setup, behaviors=stack, outer=SetBased(), max_speed=2.0)
    if knows == "all":
        setup = replace(setup, sensing=Sensors(Plain(noise=0.02), robots=5.0))
    else:
        ranges = Sensors(Plain(noise=0.02), robots=5.0)
        setup = replace(setup, sensing=ranges, sight=SEEN, radio=NEAREST if knows == "messages" else None)
    compare(setup, q, v, steps=8, tolerance=1e-8)


def escort(count: int, **changes: object) -> escort_mj.Run:
    keys = {
        "seed": 3, "duration": 40, "robots": {"count": count, "placement": {"within": 5, "least_gap": 0.5}},
        "target": {"position": ["0.3*t", 0]},
        "mission": {"radius": 3, "behaviors": [NEAR, "spacing", "surface"], "outer": "set_based"},
    }  # fmt: skip
    return escort_mj.run(Scenario(**keys).replace(changes))


@pytest.mark.parametrize("count", [2, 3, 5, 8])
def test_any_team_becomes_even(count: int) -> None:
    run = escort(count)
    assert run.values["contacts"] == 0 and run.values["radius_error_max"] < 0.01
    assert run.values["energy_ratio"] < 1.001


def test_two_heard_neighbors_are_enough() -> None:
    run = escort(6, **{"communication": {"range": 4.0, "rate": 20, "delay": 0.05, "loss": 0.1}})
    assert run.values["contacts"] == 0 and run.values["energy_ratio"] < 1.001


def test_a_team_stays_in_range() -> None:
    """The circle of five would put neighbors 5.9 m apart; the radio reaches 5 m."""
    wide = {"mission.radius": 5.0, "communication": {"range": 5.0, "rate": 20, "timeout": 0.5}}
    stack = [NEAR, {"behavior": "connect", "distance": 4.5}, "spacing", "surface"]
    apart, together = escort(5, **wide), escort(5, **{**wide, "mission.behaviors": stack})
    assert apart.trace["heard_from"].values[-1].max(axis=1).min() == 0, "somebody hears nobody"
    assert measure("disconnected_time", together.trace, 5.0).value == 0.0
