"""escort_mj: multi-robot escort missions on real physics.

>>> import escort_mj
>>> run = escort_mj.run(escort_mj.load_scenario("main", {"duration": 20}))
>>> print(run.outcome, run.metrics["radius_error_mean"]["unit"], run.trace.q.dims)
completed m ('time', 'robot', 'axis')
"""

from __future__ import annotations

TYPE_CHECKING = False  # type checkers take it for true; typing takes longer to import than this package

if TYPE_CHECKING:
    from escort_mj.api import judge, open_run, run, run_many, start
    from escort_mj.api.live import LiveMission
    from escort_mj.api.runs import Run, table
    from escort_mj.api.studies import compare, falsify, reproduce, sweep, tune
    from escort_mj.errors import EscortError, ScenarioError
    from escort_mj.record.outcome import Outcome
    from escort_mj.scenario.reader.shipped import load_scenario
    from escort_mj.scenario.schema.scenario import Scenario
    from escort_mj.standalone.controller import Controller
    from escort_mj.standalone.limits import Area, Limits

    __version__: str

_HOMES = {
    "Area": "standalone.limits",
    "Limits": "standalone.limits",
    "Controller": "standalone.controller",
    "judge": "api",
    "load_scenario": "scenario.reader.shipped",
    "run": "api",
    "run_many": "api",
    "open_run": "api",
    "start": "api",
    "LiveMission": "api.live",
    "Run": "api.runs",
    "table": "api.runs",
    "compare": "api.studies",
    "falsify": "api.studies",
    "reproduce": "api.studies",
    "sweep": "api.studies",
    "tune": "api.studies",
    "Outcome": "record.outcome",
    "Scenario": "scenario.schema.scenario",
    "EscortError": "errors",
    "ScenarioError": "errors",
}

__all__ = [
    "Area",
    "Controller",
    "EscortError",
    "Limits",
    "LiveMission",
    "Outcome",
    "Run",
    "Scenario",
    "ScenarioError",
    "compare",
    "falsify",
    "judge",
    "load_scenario",
    "open_run",
    "reproduce",
    "run",
    "run_many",
    "start",
    "sweep",
    "table",
    "tune",
]


if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """Load a public name at its first use, so that importing the package stays light."""
        if name == "__version__":
            from importlib.metadata import version

            return version("escort-mj")
        if name not in _HOMES:
            raise AttributeError(f"module 'escort_mj' has no attribute {name!r}")
        from importlib import import_module

        return getattr(import_module(f"escort_mj.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    """The public names, for completion."""
    return ["__version__", *__all__]
