"""`python -m benchmarks.gains`: the paper's gains and `gains: auto`, as the table of docs/gains.md."""

from __future__ import annotations

from typing import Any

from benchmarks.document import measure_page, swept, table

PAGE = "gains.md"
ROBOTS: dict[str, tuple[str, dict[str, Any]]] = {
    "point mass": ("main", {}),
    "point mass, motor lag 0.05 s": ("main", {"robots.actuators.lag": 0.05}),
    "rolling sphere": ("main", {"robots.kind": "rolling_sphere"}),
    "slung payload": ("robots/slung", {}),
    "quadrotor": ("robots/quadrotor", {}),
}
LAWS = ("apd_smc", "pd_smc", "asmc")
METRICS = {
    "radius_error_mean": ("radius error [mm]", 1e3),
    "tracking_error_rms": ("tracking error [mm]", 1e3),
    "chattering_over_tail": ("chattering [N/s]", 1.0),
    "saturated_share": ("saturated [%]", 100.0),
}
STUDY: dict[str, Any] = {
    "cases": {law: {"controller": {"law": law}} for law in LAWS}
    | {f"{law}, auto": {"controller": {"law": law, "gains": "auto"}} for law in LAWS},
    "first_seed": 0,
    "seeds": 5,
    "quantities": [{"metric": "chattering", "over": "tail"}],
}


def tables() -> dict[str, str]:
    """Fly the missions with both; write the table into the docs if asked."""
    rows = []
    for robot, (name, changes) in ROBOTS.items():
        study = STUDY | {"study": f"gains_{robot}", "scenario": name, "set": {"expect": []} | changes}
        found = swept(study).groupby("case", sort=False)[[*METRICS]].mean()
        for law in LAWS:
            cells = [
                f"{scale * found[key][law]:.3g} / {scale * found[key][f'{law}, auto']:.3g}"
                for key, (_, scale) in METRICS.items()
            ]
            rows.append([robot, f"`{law}`", *cells])
    heads = ["robots", "law", *(f"{words}: paper / auto" for words, _ in METRICS.values())]
    return {"gains": table(heads, rows)}


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
