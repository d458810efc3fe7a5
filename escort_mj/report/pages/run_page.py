"""A run on one self-contained HTML page: verdicts, replay, signals, metrics, figures, scenario, versions."""

from __future__ import annotations

import base64
import json
import os
import shlex
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Any

from escort_mj.expect.verdicts import Verdict, mark
from escort_mj.metrics import METRICS
from escort_mj.record.episodes import pair
from escort_mj.record.files import make_folder, write_text
from escort_mj.record.folder import FIGURES, REPORT, SCENARIO, VIDEO, StoredRun, open_run
from escort_mj.report.figures.figures import PLOTS, draw_figures
from escort_mj.report.figures.scales import number
from escort_mj.report.pages.html import Text, folded, page, picture, table
from escort_mj.report.pages.replay_data import replay_data
from escort_mj.report.pages.signals_data import signals_data
from escort_mj.report.video.video import ending, scenario_video

SCRIPTS = ("record.js", "webgl.js", "scene.js", "player.js", "uplot/uPlot.iife.min.js", "signals.js")
STYLES = ("run.css", "uplot/uPlot.min.css")
LARGEST_VIDEO = 6 << 20  # bytes of a video that goes into the page
MOST_EPISODES = 200


def report(folder: str | os.PathLike[str], out: Path | None = None) -> Path:
    """Writes the page of a run; figures that the folder does not have yet are drawn.

    Args:
        folder: A run folder.
        out: The page; None for `report.html` in the folder.

    Returns:
        The page.

    Raises:
        RunFolderError: If the folder cannot be read.
        RenderError: If there is no sample to show.
        WriteError: If the page cannot be written.
    """
    run = open_run(folder)
    if not (run.path / FIGURES).is_dir():
        draw_figures(run.path)
    path = run.path / REPORT if out is None else out
    text = page(str(run.trace.attrs["title"]), _body(run), SCRIPTS, STYLES)
    make_folder(path.parent)
    write_text(path, text)
    return path


def _body(run: StoredRun) -> Iterator[str]:
    """The page, part by part."""
    attributes = run.trace.attrs
    yield f"<h1>{escape(str(attributes['title']))}</h1>"
    if attributes.get("description"):
        yield f"<p>{escape(str(attributes['description']))}</p>"
    words, well = ending(run)
    yield f'<p class="banner {"well" if well else "ill"}">{escape(words)}</p>'
    yield from _verdicts(run)
    yield "<h2>Replay</h2>"
    if len(axes := run.trace["axis"].values) > 3:
        yield f"<p class=soft>Shown is what happens along x, y, z of the axes {escape(', '.join(axes))}.</p>"
    yield _data("replay-data", replay_data(run, scenario_video(run).speed))
    yield '<div id="replay"><p class="soft">The replay needs JavaScript and WebGL 2.</p></div>'
    yield "<h2>Signals</h2>"
    yield _data("signals-data", signals_data(run.trace))
    yield '<div id="signals"><p class="soft">The curves need JavaScript; the figures below do not.</p></div>'
    yield from _contacts(run)
    yield from _metrics(run)
    yield "<h2>Figures</h2>"
    for name in dict.fromkeys(plot.name for plot in PLOTS):
        if (file := run.path / FIGURES / f"{name}.png").is_file():
            yield picture(file, name.replace("_", " "))
    yield from _video(run)
    yield from _again(run)


def _data(name: str, value: Any) -> str:
    """Numbers for the page's scripts."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":")).replace("</", "<\\/")
    return f'<script type="application/json" id="{name}">{text}</script>'


def _moment(time: float | None) -> Text:
    """A time that leads the replay to it."""
    if time is None:
        return Text("-")
    words = f'<a href="#replay" data-seek="{time!r}" title="show it in the replay">{time:.2f} s</a>'
    return Text(words, time, html=True, kind="word")


def _verdicts(run: StoredRun) -> Iterator[str]:
    """What was expected, and whether it held."""
    verdicts = [Verdict(**verdict) for verdict in run.verdicts if "metric" in verdict]
    if not verdicts:
        return
    rows = []
    for one in verdicts:
        word = mark(one)
        kind = "good" if one.passed else "bad"
        close = ' <span class="soft">barely</span>' if one.near_miss else ""
        rows.append(
            [
                Text(f'<span class="{kind}">{word}</span>{close}', html=True, kind="word"),
                Text(one.metric),
                Text(one.demanded),
                Text(one.found, kind="message"),
                _moment(one.time),
            ]
        )
    head = [("verdict", ""), ("of", ""), ("demanded", ""), ("found", ""), ("when", "click to see it")]
    yield table("What was expected of the run", head, rows, sortable=False)


def _contacts(run: StoredRun) -> Iterator[str]:
    """Every touch of two bodies, the floor's aside."""
    trace = run.trace
    bodies = trace["body"].values
    shown = []
    for k in range(trace.sizes.get("episode", 0)):
        first, second = pair(trace, k)
        if "floor" not in (first, second):
            shown.append((k, first, second))
    yield "<h2>Contacts</h2>"
    if not shown:
        yield f"<p>None of the {len(bodies)} bodies touched another, the floor aside.</p>"
        return
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
                *(Text(number(x), x, kind="number") for x in (1e3 * duration, force, impulse, 1e3 * depth)),
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
    found = table(f"{len(shown)} unbroken touches{more}", head, rows)
    yield found if len(rows) <= 20 else folded(f"{len(shown)} touches", found)


def _metrics(run: StoredRun) -> Iterator[str]:
    """All numbers that sum the run up."""
    rows = []
    for metric in METRICS:
        found = run.metrics.get(metric.name)
        if found is None:
            continue
        value, unit = found["value"], "" if metric.unit == "1" else metric.unit
        start, end = found["window"]
        rows.append(
            [
                Text(metric.name),
                Text("-" if value is None else number(value), value, kind="number"),
                Text(unit, kind="word"),
                Text(metric.meaning if value is not None else str(found.get("reason", "")), kind="message"),
                Text(f"{start:.4g} to {end:.4g} s", kind="word"),
                _moment(found["time"]),
                Text(found["who"]),
            ]
        )
    if rows:
        head = [
            ("metric", ""),
            ("value", ""),
            ("unit", ""),
            ("meaning", ""),
            ("window", "what it looks at"),
            ("when", "the worst moment; click to see it"),
            ("who", ""),
        ]
        yield "<h2>Metrics</h2>" + table("What sums the run up", head, rows)


def _video(run: StoredRun) -> Iterator[str]:
    """The video, in the page itself where it is small enough."""
    video = run.path / VIDEO
    if not video.is_file():
        return
    yield "<h2>Video</h2>"
    size = video.stat().st_size
    if size > LARGEST_VIDEO:
        yield f"<p>{VIDEO} of the run folder has {size / 1e6:.1f} MB, too much for this page.</p>"
        return
    content = base64.b64encode(video.read_bytes()).decode()
    yield f'<video controls preload="metadata" src="data:video/mp4;base64,{content}"></video>'


def _again(run: StoredRun) -> Iterator[str]:
    """The scenario, by which versions it ran, and how it runs again."""
    outcome = run.outcome
    yield "<h2>Scenario</h2>"
    scenario = f"<pre><code>{escape(run.scenario_yaml)}</code></pre>"
    yield folded(f"{SCENARIO}, complete: every default written out", scenario)
    command = f"escort-mj run {SCENARIO} --out again"
    folder = shlex.quote(run.path.name)
    yield "<h2>Run it again</h2>"
    yield (
        f"<p>Save the scenario above as {SCENARIO}, then <code>{escape(command)}</code>; or, with the run "
        f"folder, <code>escort-mj rerun {escape(folder)}</code>, which says whether the bits agree.</p>"
    )
    versions = {"platform": outcome.get("platform", ""), **outcome.get("versions", {})}
    facts = {
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
    yield table("How it was made", [("", ""), ("", "")], rows, sortable=False)
