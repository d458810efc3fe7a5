"""A run on one self-contained HTML page: verdicts, replay, signals, metrics, figures, scenario, versions."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from escort_mj.expect.verdicts import mark
from escort_mj.files import write_text
from escort_mj.record.episodes import apart_from, pair
from escort_mj.record.folder import FIGURES, REPORT, SCENARIO, VIDEO, StoredRun, read_run
from escort_mj.record.recording import LOG, NOT_LOGGED
from escort_mj.report.figures.drawing.scales import readable
from escort_mj.report.figures.figures import PLOTS, draw_figures
from escort_mj.report.pages.html import Table, Text, page, page_file
from escort_mj.report.pages.replay_data import replay_data
from escort_mj.report.pages.signals_data import signals_data
from escort_mj.report.video.video import ending, scenario_video

SCRIPTS = ("record.js", "webgl.js", "scene.js", "player.js", "uplot/uPlot.iife.min.js", "signals.js")
STYLES = ("run.css", "uplot/uPlot.min.css")
LARGEST_VIDEO = 6 << 20  # bytes of a video that goes into the page
MOST_EPISODES = 200


def write_run_page(folder: str | os.PathLike[str], out: Path | None = None) -> Path:
    """Write the page of a run; figures that the folder does not have yet are drawn.

    Args:
        folder: A run folder.
        out: The page; None for `report.html` in the folder.

    Returns:
        The page.

    Raises:
        RunFolderError: If the folder cannot be read.
        UsageError: If the suffix of the page is that of something else.
        RenderError: If there is no sample to show.
        WriteError: If the page cannot be written.
    """
    run = read_run(folder)
    path = page_file(out, run.path / REPORT)
    if not (run.path / FIGURES).is_dir():
        draw_figures(run.path)
    text = page("run.html", _parts(run))
    write_text(path, text)
    return path


def _parts(run: StoredRun) -> dict[str, Any]:
    """What the page shows."""
    words, well = ending(run)
    episodes = np.flatnonzero(apart_from(run.trace, "floor")).tolist()
    touched = [(episode, *pair(run.trace, episode)) for episode in episodes]
    video = run.path / VIDEO
    size = video.stat().st_size if video.is_file() else 0
    names = dict.fromkeys(plot.name for plot in PLOTS)
    return {
        "run": run,
        "title": run.trace.attrs["title"],
        "scripts": SCRIPTS,
        "styles": STYLES,
        "ending": words,
        "well": well,
        "verdicts": _verdicts(run),
        "replay": replay_data(run, scenario_video(run).speed),
        "signals": signals_data(run.trace),
        "touches": len(touched),
        "contacts": _contacts(run, touched),
        "metrics": _metrics(run),
        "figures": [file for name in names if (file := run.path / FIGURES / f"{name}.png").is_file()],
        "video": video if size else None,
        "too_large": f"{size / 1e6:.1f} MB" if size > LARGEST_VIDEO else "",
        "file": SCENARIO,
        "folder": shlex.quote(run.path.name),
        "facts": _facts(run),
    }


def _moment(time: float | None) -> Text:
    """A time that leads the replay to it."""
    if time is None:
        return Text("-")
    words = Markup('<a href="#replay" data-seek="{!r}" title="show it in the replay">{:.2f} s</a>')
    return Text(words.format(time, time), time, kind="word")


def _verdicts(run: StoredRun) -> Table:
    """What was expected, and whether it held."""
    rows = []
    for one in run.verdicts:
        words = '<span class="{}">{}</span>' + (' <span class="soft">barely</span>' if one.near_miss else "")
        shown = Markup(words).format("good" if one.passed else "bad", mark(one))
        rows.append(
            [
                Text(shown, kind="word"),
                Text(one.metric),
                Text(one.demanded),
                Text(one.found, kind="message"),
                _moment(one.time),
            ]
        )
    head = [("verdict", ""), ("of", ""), ("demanded", ""), ("found", ""), ("when", "click to see it")]
    return Table("What was expected of the run", head, rows, sortable=False)


def _contacts(run: StoredRun, shown: Sequence[tuple[int, str, str]]) -> Table:
    """When, for how long and how hard bodies touched: the episodes' numbers, and who touched."""
    trace = run.trace
    rows = []
    for k, first, second in shown[:MOST_EPISODES]:
        force, impulse, depth = (
            float(trace[f"episode_{name}"][k]) for name in ("peak_force", "impulse", "depth")
        )
        duration = float(trace["episode_end"][k]) - float(trace["episode_start"][k])
        rows.append(
            [
                Text(f"{first} and {second}"),
                _moment(float(trace["episode_start"][k])),
                *(Text(readable(x), x, kind="number") for x in (1e3 * duration, force, impulse, 1e3 * depth)),
            ]
        )
    head = [
        ("bodies", ""),
        ("when", "of the first touch; click to see it"),
        ("for [ms]", "until they part"),
        ("peak force [N]", "largest normal force of a physics step"),
        ("impulse [N s]", ""),
        ("depth [mm]", "largest penetration"),
    ]
    more = f"; the first {MOST_EPISODES} of {len(shown)}" if len(shown) > MOST_EPISODES else ""
    return Table(f"{len(shown)} unbroken touches{more}", head, rows)


def _metrics(run: StoredRun) -> Table:
    """All numbers that sum the run up."""
    rows = []
    for name, found in run.metrics.items():
        if name == "run":
            continue
        value, unit = found["value"], "" if found["unit"] == "1" else found["unit"]
        start, end = found["window"]
        about, rate = found.get("meaning", ""), found.get("rate")
        rows.append(
            [
                Text(name),
                Text("-" if value is None else readable(value), value, kind="number"),
                Text(unit, kind="word"),
                Text(about if value is not None else str(found.get("reason", "")), kind="message"),
                Text(f"{start:.4g} to {end:.4g} s", kind="word"),
                Text("-" if rate is None else f"{rate:.4g}", rate, kind="number"),
                _moment(found["time"]),
                Text(found["who"]),
            ]
        )
    head = [
        ("metric", ""),
        ("value", ""),
        ("unit", ""),
        ("meaning", ""),
        ("window", "the part of the run that it looks at"),
        ("rate [1/s]", "how often it looks: at the samples, or at every physics step"),
        ("when", "the worst moment; click to see it"),
        ("who", ""),
    ]
    return Table("What sums the run up", head, rows)


def _facts(run: StoredRun) -> Table:
    """How it was made."""
    outcome = run.outcome
    versions = {"platform": outcome.get("platform", ""), **outcome.get("versions", {})}
    facts = {
        "log of real robots": str(run.trace.attrs.get(LOG, "")),
        "not in the log": str(run.trace.attrs.get(NOT_LOGGED, "")).replace(" ", ", "),
        "law": str(run.trace.attrs["law"]) if "law" in run.trace.attrs else "",
        "seed": str(run.trace.attrs.get("seed", "")),
        "timestep": f"{float(run.trace.attrs['timestep']):g} s",
        "samples": f"{run.trace.sizes['time']} up to {float(run.trace['time'][-1]):.4g} s",
        "physics": str(run.trace.attrs.get("contact_physics", "")),
        "started": str(outcome.get("started", "")),
        "wall time": f"{outcome['wall_time']:.2f} s" if "wall_time" in outcome else "",
        **{key: str(value) for key, value in versions.items()},
    }
    rows = [[Text(key), Text(value, kind="message")] for key, value in facts.items() if value]
    return Table("How it was made", [("", ""), ("", "")], rows, sortable=False)
