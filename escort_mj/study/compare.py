"""Laws and outer loops side by side: a study of one scenario, every law with every loop."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from escort_mj.control.outer_loops import OUTER_LOOPS, OuterLoop
from escort_mj.errors import UsageError
from escort_mj.laws import LAWS as SHIPPED
from escort_mj.laws import Law
from escort_mj.metrics import METRICS
from escort_mj.record.window import Span, span_faults
from escort_mj.scenario import Scenario
from escort_mj.scenario.findings import did_you_mean, key_path
from escort_mj.scenario.geometry.team_gains import owners
from escort_mj.scenario.reader.catalog import catalog_of

LAW, LOOP = "controller", "mission.outer"
"""The factors of such a study."""
LAWS = {str(law.own_name()): law.title_of() for law in SHIPPED}
"""Titles of the laws that come with the package."""
OUTERS = {str(loop.own_name()): loop.title for loop in OUTER_LOOPS}
COMPARED = (
    "settling_time",
    "radius_error_mean",
    "spacing_error_mean",
    "tracking_error_rms",
    "true_error_rms",
    "true_error_max",
    "velocity_error_rms",
    "chattering",
    "force_rms",
    "energy",
    "obstacle_clearance_min",
    "robot_clearance_min",
    "contacts",
    "saturated_share",
)


def comparison_of(
    scenario: Scenario,
    path: Path,
    laws: Sequence[str] = (),
    outers: Sequence[str] = (),
    seeds: int = 1,
    over: Span | None = None,
) -> dict[str, Any]:
    """Return the study that compares laws and outer loops on a scenario; its runs expect nothing.

    Args:
        scenario: What to run; its own law's gains go to the other laws where they mean the same, and all
            teams and robots get the same law.
        path: Its file.
        laws: Names of laws, each of them one or several between commas; empty for all.
        outers: Names of outer loops, likewise; empty for the scenario's own.
        seeds: How many seeds, from the scenario's own upward.
        over: The part of each run that quantities look at; None for that of each. A moment is looked for in
            the whole run.

    Raises:
        UsageError: If there is no such law or outer loop, or no such part of a run.
    """
    check_span(over, scenario.duration)
    known = [str(model.own_name()) for model in catalog_of(scenario).of(Law)]
    names = chosen_names("--laws", laws, known, known)
    loops = chosen_names("--outer", outers, OUTERS, [scenario.mission.outer.loop])
    moments = {metric.name for metric in METRICS if metric.moment}
    window = {} if over is None else {"over": over.over, "after": over.after or None, "before": over.before}
    return {
        "study": scenario.name,
        "scenario": str(path),
        "set": {"expect": [], **{key_path((*owner, LAW)): None for owner in owners(scenario) if owner}},
        "vary": {
            LAW: [controller_of(scenario, name).model_dump() for name in names],
            LOOP: [outer_of(scenario, name).model_dump() for name in loops],
        },
        "seeds": seeds,
        "first_seed": scenario.seed,
        "traces": "all",
        "quantities": [
            {"metric": name} | ({} if name in moments else {k: v for k, v in window.items() if v is not None})
            for name in COMPARED
        ],
    }


def check_span(over: Span | None, duration: float) -> None:
    """Refuse a part of a run that runs of a duration [s] do not have.

    Raises:
        UsageError: If it is none.
    """
    if over is None:
        return
    for words in span_faults(over.over, over.after or None, over.before):
        raise UsageError(f"--over, --after, --before: {words}")
    if over.after >= duration or (over.before or 0.0) > duration:
        key, time = ("--after", over.after) if over.after >= duration else ("--before", over.before)
        raise UsageError(f"{key} {time:g}: the run ends at {duration:g} s")


def title_of(level: str) -> str:
    """What pictures and tables call a law or an outer loop: one of a plugin by its name."""
    return LAWS.get(level) or OUTERS.get(level) or level


def chosen_names(
    option: str, words: Sequence[str], known: Iterable[str], default: Sequence[str]
) -> list[str]:
    """Names that a user picks, such as `apd_smc,pd`, in the order given and each once.

    Args:
        option: What to call it in messages.
        words: What the user wrote; every one may hold several names.
        known: All that there are.
        default: What is meant by writing nothing.

    Raises:
        UsageError: If there is no such name.
    """
    names = list(known)
    picked = [word.strip() for text in words for word in text.split(",") if word.strip()]
    if words and not picked:
        raise UsageError(f"{option}: found no name; allowed are {', '.join(names)}")
    for word in picked:
        if word not in names:
            raise UsageError(f"{option} {word}: allowed are {', '.join(names)}{did_you_mean(word, names)}")
    return list(dict.fromkeys(picked)) or list(default)


def controller_of(base: Scenario, law: str) -> Law:
    """A law with the gains of the scenario's own law, where both have them and mean the same by them.

    Args:
        base: The scenario.
        law: Name of the law; the scenario's own law comes back as it is.
    """
    if base.controller.law == law:
        return base.controller
    (model,) = [model for model in catalog_of(base).of(Law) if model.own_name() == law]
    own = model.own_keys | base.controller.own_keys | {"law"}
    shared = [
        key for key in type(base.controller).model_fields if key in model.model_fields and key not in own
    ]
    return model(**{key: getattr(base.controller, key) for key in shared})


def outer_of(base: Scenario, loop: str) -> OuterLoop:
    """An outer loop by its name: the scenario's own as it is, any other with its default gains."""
    if base.mission.outer.loop == loop:
        return base.mission.outer
    (model,) = [model for model in OUTER_LOOPS if model.own_name() == loop]
    return model.model_validate({})
