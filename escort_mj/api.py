"""What users import: load a scenario, run it, get everything that came of it."""

from __future__ import annotations

import os
from importlib.resources import files
from pathlib import Path

from escort_mj.errors import RenderError
from escort_mj.mission import Progress, Run, fly
from escort_mj.record.folder import RunFolder
from escort_mj.scenario import Scenario
from escort_mj.scenario import load_scenario as _load_file
from escort_mj.scenario.overrides import Overrides

__all__ = ["fly", "load_scenario", "run"]


def scenarios_folder() -> Path:
    """Folder of the shipped scenarios: inside an installed package, or beside the package in a checkout."""
    package = Path(str(files("escort_mj")))
    return package / "scenarios" if (package / "scenarios").is_dir() else package.parent / "scenarios"


def load_scenario(path: str | os.PathLike[str], overrides: Overrides = ()) -> Scenario:
    """Reads and checks a scenario.

    Args:
        path: A YAML file, or the name of a shipped scenario such as `main` or `paper/case1_2d`.
        overrides: Texts `key.path=value`, or a mapping of key paths, that replace values of the file.

    Raises:
        ScenarioError: With every fault of the file at once.
    """
    name = os.fspath(path)
    shipped = scenarios_folder() / f"{name}.yaml"
    if not Path(name).exists() and not name.endswith((".yaml", ".yml")) and shipped.is_file():
        path = shipped
    return _load_file(path, overrides)


def run(
    scenario: Scenario | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    figures: bool = True,
    video: bool = True,
    progress: Progress | None = None,
) -> Run:
    """Runs a scenario.

    Args:
        scenario: A scenario, or what `load_scenario` takes.
        out: Run folder to write; None keeps everything in memory.
        figures: Whether a run folder gets its figures.
        video: Whether a run folder gets its video; without GL there is none, and `outcome.json` is complete.
        progress: Called now and then with the simulated time reached and the time to reach [s].

    Returns:
        Outcome, trace, metrics and verdicts.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    if out is None:
        return fly(scenario, None, progress)
    folder = RunFolder.create(Path(out))
    result = fly(scenario, folder, progress)
    if figures:
        from escort_mj.report.figures import draw_figures

        draw_figures(folder.path)
    if video:
        import warnings

        from escort_mj.report.video import render_video

        try:
            render_video(folder.path)
        except RenderError as error:
            warnings.warn(f"no video: {error}", stacklevel=2)
    return result
