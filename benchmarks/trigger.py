"""`python -m benchmarks.trigger`: what the event trigger saves and costs, as docs/event_trigger.md."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any, NamedTuple

os.environ.setdefault("MUJOCO_GL", "disable")

import numpy as np  # noqa: E402

from benchmarks.document import DOCS, publish, table, wants_docs  # noqa: E402
from escort_mj.api import fly, load_scenario  # noqa: E402
from escort_mj.measuring import measure_over
from escort_mj.record.window import Span

PAGE = "event_trigger.md"
MISSIONS = {
    "case 1, plane (chords)": "paper/case1_2d",
    "case 1, space (chords)": "paper/case1_3d",
    "moving target, space (vertices)": "event_triggered",
}
LONGEST = (0.01, 0.02, 0.04, 0.06, 0.1, 0.2, 0.5, 1.0)  # [s]
SEEDS = range(1, 9)
NAMES = ("outer_update_rate", "radius_error_mean", "spacing_error_mean", "contacts")


class Point(NamedTuple):
    """Means over the seeds, of the tail of each run but for updates and contacts."""

    rate: float  # [1/s]
    radius: float  # [m]
    spacing: float  # [m]
    contacts: float
    chattering: float  # [N/s]


def point(scenario: str, longest: float | None) -> Point:
    """One mission with one trigger; None is every step."""
    trigger = None if longest is None else {"dwell": longest / 2, "longest": longest}
    values = []
    for seed in SEEDS:
        overrides = {"expect": [], "mission.trigger": trigger, "seed": seed}
        run = fly(load_scenario(scenario, overrides))
        chattering = measure_over("chattering", run.trace, Span("tail")).value
        values.append([*(run.metrics[name]["value"] for name in NAMES), chattering])
    return Point(*np.mean(values, axis=0))


def rows(points: dict[str, list[Point]]) -> Iterator[list[str]]:
    """Table rows."""
    for words, found in points.items():
        every = found[0]
        for longest, p in zip((None, *LONGEST), found, strict=True):
            yield [
                words,
                "every step" if longest is None else f"{1e3 * longest:g} ms",
                f"{p.rate:.1f}",
                f"{100.0 * (1.0 - p.rate / every.rate):.1f} %",
                f"{1e3 * p.radius:.2f} ({p.radius / every.radius:.2f})",
                f"{1e3 * p.spacing:.2f} ({p.spacing / every.spacing:.2f})",
                f"{p.chattering:.0f}",
                f"{p.contacts:g}",
            ]


def draw(points: dict[str, list[Point]]) -> None:
    """The trade-off as a curve per mission."""
    from escort_mj import palette
    from escort_mj.report.figures.drawing.style import figure

    path, title = DOCS / "figures" / "event_trigger.png", "Event trigger: updates against precision"
    with figure(path, 3.6, title) as canvas:
        axes = canvas.subplots()
        for (words, found), color in zip(points.items(), palette.robot_colors(3), strict=True):
            saved = [100.0 * (1.0 - p.rate / found[0].rate) for p in found[1:]]
            axes.plot(
                saved, [p.radius / found[0].radius for p in found[1:]], "o-", color=color, ms=3, label=words
            )
        axes.axhline(2.0, color=palette.LIMIT, linestyle=(0, (4, 2)), linewidth=1.0, label="twice the error")
        axes.axvline(95.0, color=palette.LIMIT, linestyle=(0, (1, 2)), linewidth=1.0, label="95 % saved")
        axes.set_yscale("log", base=2)
        axes.set_yticks([1, 2, 4, 8], ["1", "2", "4", "8"])
        axes.set_ylabel("tail error of the radius\nover that of every step")
        axes.set_xlabel("updates of the outer loop saved [%]")
        axes.legend(loc="upper left")


def main(arguments: Any = None) -> None:
    """Measures, prints the table, and writes table and figure into the docs if asked."""
    write = wants_docs(__doc__, PAGE, arguments)
    points = {
        words: [point(scenario, longest) for longest in (None, *LONGEST)]
        for words, scenario in MISSIONS.items()
    }
    head = [
        "mission",
        "longest",
        "updates [1/s]",
        "saved",
        "radius [mm]",
        "spacing [mm]",
        "chattering [N/s]",
        "touches",
    ]
    publish(PAGE, {"trade-off": table(head, rows(points))}, write)
    if write:
        draw(points)


if __name__ == "__main__":
    main()
