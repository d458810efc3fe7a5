"""`python -m benchmarks.robots`: kinds of robots under the sliding laws, as the tables of docs/robots.md."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from benchmarks.document import measure_page, swept, table
from escort_mj.api import load_scenario
from escort_mj.laws import LAWS

if TYPE_CHECKING:
    import pandas

PAGE = "robots.md"
KINDS = ("slung", "loaded", "quadrotor", "mixed")
NAMES = ("apd_smc", "asmc", "pd_smc")
SOFT = {"proportional_gain": 12, "derivative_gain": 12, "adaptation_rate": 6, "slope": 10}
LAST = 5.0  # s: robots have passed the last obstacle before
PLAIN = {"robots.kind": "point_mass"}
DRIVEN = {  # kinds that cannot move sideways: their gains as far as laws have them
    "diff_drive": {"proportional_gain": 12, "derivative_gain": 12, "adaptation_rate": 6, "slope": 10},
    "surface_vessel": {"proportional_gain": 5, "derivative_gain": 15, "adaptation_rate": 2, "slope": 1},
}
TROUBLES: dict[str, dict[str, Any]] = {
    "none: point masses": PLAIN,
    **{f"payload {m:g} times the mass": {"robots.kind.payload": m} for m in (0.2, 0.5, 1.0, 2.0, 5.0)},
    **{f"lag of {1e3 * s:g} ms": PLAIN | {"robots.actuators.lag": s} for s in (0.01, 0.02, 0.05, 0.1)},
    **{f"dead zone {zone:g} N": PLAIN | {"robots.actuators.dead_zone": zone} for zone in (0.1, 1.0, 5.0)},
    **{f"gains off by {100 * e:g} %": PLAIN | {"robots.actuators.gain_error": e} for e in (0.1, 0.3, 0.6)},
}
"""One hidden effect at a time, on the mission of slung robots with the paper's gains."""
MEASURED = [
    "verdicts passed", "error in the last 5 s, worst [mm]", "to obstacles [m]", "to robots [m]", "at a limit",
    "N/s",
]  # fmt: skip


def gains(law: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """A law with gains as far as it has them, and its own defaults: the paper's."""
    (kind,) = (each for each in LAWS if each.model_fields["law"].default == law)
    return {"law": law} | {key: value for key, value in values.items() if key in kind.model_fields}


def missions(kind: str) -> dict[str, dict[str, Any]]:
    """The laws and gains of a kind, and what each sets."""
    ways: dict[str, dict[str, Any]] = {} if kind in ("slung", "loaded") else {"softer": SOFT}
    ways["the paper's"] = {}
    return {
        f"{law}, {name}": {"controller": gains(law, chosen)} for law in NAMES for name, chosen in ways.items()
    }


def driven(kind: str) -> dict[str, dict[str, Any]]:
    """Return the same of a kind that cannot move sideways, with its scenario's gains and with `auto`."""
    own = DRIVEN[kind]
    return {
        f"{law}, {name}": {"controller": chosen}
        for law in NAMES
        for name, chosen in (
            ("the scenario's", gains(law, own if law != "asmc" else {"slope": own["slope"]})),
            ("auto", {"law": law, "gains": "auto"}),
        )
    }


def rows(study: str, kind: str, cases: Mapping[str, Any], seeds: int) -> Iterator[list[str]]:
    """Flies the cases of a kind; one row per case: what it is, and what came of it."""
    after = load_scenario(f"robots/{kind}").duration - LAST
    error, effort = f"radius_error_mean_after_{after:g}", "chattering_over_tail"
    windows = [{"metric": "radius_error_mean", "after": after}, {"metric": "chattering", "over": "tail"}]
    keys = {"study": study, "scenario": f"robots/{kind}", "cases": cases, "first_seed": 1, "seeds": seeds}
    for case, runs in swept(keys | {"quantities": windows}).groupby("case", sort=False):
        yield [*str(case).split(", "), *_measured(runs, error, effort)]


def _measured(runs: pandas.DataFrame, error: str, effort: str) -> list[str]:
    passed = f"{runs['passed'].sum()} of {len(runs)}"
    if not runs["passed"].any():  # how a team fails depends on rounding
        return [passed, *["-"] * (len(MEASURED) - 1)]
    flown = runs[runs["outcome"] == "completed"]
    touched = int((runs["contacts"] > 0).sum())
    return [
        passed,
        f"{1e3 * flown[error].median():.2g} ({1e3 * flown[error].max():.2g})",
        f"{flown['obstacle_clearance_min'].min():.2f}" + (f" ({touched} touched)" if touched else ""),
        f"{flown['robot_clearance_min'].min():.2f}",
        f"{100 * flown['saturated_share'].mean():.1f} %",
        f"{flown[effort].median():.0f}",
    ]


def tables() -> dict[str, str]:
    """Makes the runs, prints the tables, and writes them into the docs if asked."""
    head = ["robots", "law", "gains", *MEASURED]
    kinds = [[k, *row] for k in KINDS for row in rows(f"robots_{k}", k, missions(k), 5)]
    sideways = [[k, *row] for k in DRIVEN for row in rows(f"robots_{k}", k, driven(k), 20)]
    troubles = rows("robots_troubles", "slung", TROUBLES, 5)
    return {
        "kinds": table(head, kinds),
        "driven": table(head, sideways),
        "troubles": table(["hidden effect", *MEASURED], troubles),
    }


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
