"""`gains: auto` in a scenario's controller: gains that fit its robots, written into it once it is checked."""

from __future__ import annotations

from typing import Any

from escort_mj.laws.gains import LAWS_WITH_A_RULE
from escort_mj.scenario.findings import Finding, listed, shown
from escort_mj.scenario.geometry.team_gains import proposal
from escort_mj.scenario.schema.scenario import Scenario

KEY, AUTO = "gains", "auto"
PATH = ("controller", KEY)


def without_gains(data: dict[str, Any]) -> tuple[dict[str, Any], bool, list[Finding]]:
    """Return plain data without `gains`, whether it was `auto`, and what is wrong with it.

    Args:
        data: What a scenario says; it is not changed.
    """
    controller = data.get("controller")
    if not isinstance(controller, dict) or KEY not in controller:
        return data, False, []
    rest = {key: value for key, value in controller.items() if key != KEY}
    auto = controller[KEY] == AUTO
    wrong = (
        [] if auto else [Finding(PATH, f"found {shown(controller[KEY])}; allowed is auto, or no such key")]
    )
    return data | {"controller": rest}, auto, wrong


def with_gains(data: dict[str, Any], scenario: Scenario) -> tuple[dict[str, Any], list[Finding]]:
    """Return plain data with the gains that fit; those that it names itself stay.

    Args:
        data: Plain data without `gains`; it is not changed.
        scenario: What it describes.
    """
    found = proposal(scenario)
    if found is None:
        law = str(scenario.controller.law)
        if law in LAWS_WITH_A_RULE:
            words = "found auto, but the servos of the robots move them: the law's gains have no effect"
        else:
            words = f"found auto with the law {law}; there is a rule for {listed(list(LAWS_WITH_A_RULE))}"
        return data, [Finding(PATH, words)]
    return data | {"controller": {**found.gains, "law": found.law, **data["controller"]}}, []
