"""escort_mj: multi-robot escort missions on real physics.

import escort_mj

run = escort_mj.run(escort_mj.load_scenario("main", ["duration=20"]))
print(run.outcome, run.metrics["radius_error_mean"], run.trace.q)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from escort_mj.api import load_scenario, run, run_many
    from escort_mj.errors import EscortError, ScenarioError
    from escort_mj.mission import Run
    from escort_mj.record.folder import open_run
    from escort_mj.record.outcome import Outcome
    from escort_mj.scenario.schema.scenario import Scenario

_HOMES = {
    "load_scenario": "api",
    "run": "api",
    "run_many": "api",
    "Run": "mission",
    "open_run": "record.folder",
    "Outcome": "record.outcome",
    "Scenario": "scenario.schema.scenario",
    "EscortError": "errors",
    "ScenarioError": "errors",
}

__all__ = [
    "EscortError",
    "Outcome",
    "Run",
    "Scenario",
    "ScenarioError",
    "load_scenario",
    "open_run",
    "run",
    "run_many",
]


def __getattr__(name: str) -> Any:
    """Loads a public name at its first use, so that importing the package stays light."""
    if name not in _HOMES:
        raise AttributeError(f"module 'escort_mj' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"escort_mj.{_HOMES[name]}"), name)
