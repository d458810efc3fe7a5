"""escort_mj: multi-robot escort missions on real physics.

>>> import escort_mj
>>> run = escort_mj.run(escort_mj.load_scenario("main", {"duration": 20}))
>>> print(run.outcome, run.metrics["radius_error_mean"]["unit"], run.trace.q.dims)
completed m ('time', 'robot', 'axis')
"""

from __future__ import annotations

from escort_mj.version import __version__ as __version__

TYPE_CHECKING = False  # type checkers take it for true; typing takes longer to import than this package

if TYPE_CHECKING:
    from escort_mj.api import judge, open_run, replay, run, run_many, start
    from escort_mj.api.live import LiveMission
    from escort_mj.api.live_log import LiveLog
    from escort_mj.api.runs import Run, table
    from escort_mj.api.studies import compare, falsify, reproduce, sweep, tune
    from escort_mj.errors import EscortError, ScenarioError
    from escort_mj.record.outcome import Outcome
    from escort_mj.scenario.reader.shipped import load_scenario
    from escort_mj.scenario.schema.scenario import Scenario
    from escort_mj.standalone.controller import Controller
    from escort_mj.standalone.limits import Area, Limits


_HOMES = {
    name: home
    for home, names in {
        "api": "judge open_run replay run run_many start",
        "api.live": "LiveMission",
        "api.live_log": "LiveLog",
        "api.runs": "Run table",
        "api.studies": "compare falsify reproduce sweep tune",
        "errors": "EscortError ScenarioError",
        "record.outcome": "Outcome",
        "scenario.reader.shipped": "load_scenario",
        "scenario.schema.scenario": "Scenario",
        "standalone.controller": "Controller",
        "standalone.limits": "Area Limits",
    }.items()
    for name in names.split()
}

__all__ = [
    "Area",
    "Controller",
    "EscortError",
    "Limits",
    "LiveLog",
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
    "replay",
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
        if name not in _HOMES:
            raise AttributeError(f"module 'escort_mj' has no attribute {name!r}")
        import gc
        from importlib import import_module

        collects = gc.isenabled()
        gc.disable()  # what modules hold stays, and looking for garbage among it takes a tenth of the time
        try:
            return globals().setdefault(name, getattr(import_module(f"escort_mj.{_HOMES[name]}"), name))
        finally:
            if collects and not gc.get_freeze_count():
                gc.freeze()
                gc.unfreeze()  # now they are old: the next look, at what is new, leaves them out
            if collects:
                gc.enable()


def __dir__() -> list[str]:
    """The public names, for completion."""
    return ["__version__", *__all__]
