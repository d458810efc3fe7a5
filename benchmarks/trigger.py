"""`python -m benchmarks.trigger`: what the event trigger saves and costs, as docs/event_trigger.md."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from benchmarks.document import DOCS, publish, swept, table_of, wants_docs

if TYPE_CHECKING:
    import pandas

PAGE = "event_trigger.md"
MISSIONS = {
    "case 1, plane (chords)": "paper/case1_2d",
    "case 1, space (chords)": "paper/case1_3d",
    "moving target, space (vertices)": "event_triggered",
}
LONGEST = (0.01, 0.02, 0.04, 0.06, 0.1, 0.2, 0.5, 1.0)  # [s]
RATE, RADIUS, SPACING, CHATTERING = (
    "outer_update_rate", "radius_error_mean", "spacing_error_mean", "chattering_over_tail"
)  # fmt: skip
CASES: dict[str, Any] = {"every step": {"mission.trigger": None}} | {
    f"{1e3 * longest:g} ms": {"mission.trigger": {"dwell": longest / 2, "longest": longest}}
    for longest in LONGEST
}
STUDY: dict[str, Any] = {
    "set": {"expect": []},
    "cases": CASES,
    "first_seed": 1,
    "seeds": 8,
    "quantities": [{"metric": "chattering", "over": "tail"}],
}


def means(scenario: str) -> pandas.DataFrame:
    """Means over the seeds of one mission with each trigger."""
    keys = STUDY | {"study": f"trigger_{scenario.rpartition('/')[2]}", "scenario": scenario}
    return swept(keys).groupby("case", sort=False)[[RATE, RADIUS, SPACING, CHATTERING, "contacts"]].mean()


COLUMNS = {
    "mission": "{mission}",
    "longest": "{case}",
    "updates [1/s]": "{outer_update_rate:.1f}",
    "saved": "{saved:.1f} %",
    "radius [mm]": "{radius:.2f} ({radius_ratio:.2f})",
    "spacing [mm]": "{spacing:.2f} ({spacing_ratio:.2f})",
    "chattering [N/s]": "{chattering_over_tail:.0f}",
    "touches": "{contacts:g}",
}


def rows(points: dict[str, pandas.DataFrame]) -> Iterator[dict[str, Any]]:
    """What each trigger saves and costs in each mission."""
    for words, found in points.items():
        share = found / found.iloc[0]
        for case, p in found.iterrows():
            yield {
                "mission": words,
                "case": case,
                "saved": 100.0 * (1.0 - share[RATE][case]),
                "radius": 1e3 * p[RADIUS],
                "radius_ratio": share[RADIUS][case],
                "spacing": 1e3 * p[SPACING],
                "spacing_ratio": share[SPACING][case],
                **p,
            }


def draw(points: dict[str, pandas.DataFrame]) -> None:
    """The trade-off as a curve per mission."""
    from escort_mj import palette
    from escort_mj.report.figures.drawing.style import figure

    path, title = DOCS / "figures" / "event_trigger.png", "Event trigger: updates against precision"
    with figure(path, 3.6, title) as canvas:
        axes = canvas.subplots()
        for (words, found), color in zip(points.items(), palette.robot_colors(3), strict=True):
            share = found / found.iloc[0]
            saved, errors = 100.0 * (1.0 - share[RATE][1:]), share[RADIUS][1:]
            axes.plot(saved, errors, "o-", color=color, ms=3, label=words)
        axes.axhline(2.0, color=palette.LIMIT, linestyle=(0, (4, 2)), linewidth=1.0, label="twice the error")
        axes.axvline(95.0, color=palette.LIMIT, linestyle=(0, (1, 2)), linewidth=1.0, label="95 % saved")
        axes.set_yscale("log", base=2)
        axes.set_yticks([1, 2, 4, 8], ["1", "2", "4", "8"])
        axes.set_ylabel("tail error of the radius\nover that of every step")
        axes.set_xlabel("updates of the outer loop saved [%]")
        axes.legend(loc="upper left")


def main() -> None:
    """Measures, prints the table, and writes table and figure into the docs if asked."""
    write = wants_docs(__doc__, PAGE)
    points = {words: means(scenario) for words, scenario in MISSIONS.items()}
    publish(PAGE, {"trade-off": table_of(rows(points), COLUMNS)}, write)
    if write:
        draw(points)


if __name__ == "__main__":
    main()
