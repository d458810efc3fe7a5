"""`python -m benchmarks.sensing`: what delays and dropouts cost, as the tables of docs/sensing.md."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.document import grid, measure_page, swept, table

if TYPE_CHECKING:
    import pandas

PAGE = "sensing.md"
STEP = 0.002  # s
DELAYS = [STEP * steps for steps in (0, 2, 4, 6, 8, 10, 14, 20, 30, 50, 100)]
CHANNELS = {"own": ("position", "velocity"), "own velocity": ("velocity",), "own position": ("position",)}
COLUMNS = [("apd_smc", name) for name in CHANNELS] + [("asmc", "own"), ("pd_smc", "own")]
ERROR, FORCE = "radius_error_mean_after_30", "force_rms_after_30"  # of 40 s
STUDY: dict[str, Any] = {
    "scenario": "paper/case1_2d",
    "set": {"expect": [], "physics.timestep": STEP},
    "first_seed": 1,
    "seeds": 3,
    "quantities": [{"metric": name, "after": 30} for name in ("radius_error_mean", "force_rms")],
}
DELAYED = {
    "study": "sensing_delay",
    "parameters": {"delay": 0.0},
    "cases": {
        f"{law}: {name}": {"controller": law}
        | {f"sensing.{channel}.delay": "{delay}" for channel in CHANNELS[name]}
        for law, name in COLUMNS
    },
    "vary": {"delay": DELAYS},
}
DROPPED = {
    "study": "sensing_dropout",
    "parameters": {"dropout": 0.0},
    "cases": {
        f"own, {1e3 * delay:g} ms": {"controller": "apd_smc"}
        | {f"sensing.{channel}.delay": delay for channel in CHANNELS["own"]}
        | {f"sensing.{channel}.dropout": "{dropout}" for channel in CHANNELS["own"]}
        for delay in (0.0, 4 * STEP)
    },
    "vary": {"dropout": [0.0, 0.05, 0.5, 0.9, 0.98]},
}


def cell(runs: pandas.DataFrame) -> str:
    """Mean error [mm] and rms force [N] over the seeds; who did not complete is counted."""
    if lost := int((runs["outcome"] != "completed").sum()):
        return f"diverged ({lost}/{len(runs)})"
    return f"{1e3 * runs[ERROR].mean():.3g} ({runs[FORCE].mean():.2g})"


def tables() -> dict[str, str]:
    """Makes the runs, prints the tables, and writes them into the docs if asked."""
    delayed = grid(swept(STUDY | DELAYED), "delay", "case", cell, lambda delay: f"{1e3 * delay:g}")
    dropped = grid(swept(STUDY | DROPPED), "dropout", "case", cell, lambda share: f"{100 * share:g} %")
    return {
        "delay": table(["delay [ms]", *DELAYED["cases"]], delayed),
        "dropout": table(["dropout", *DROPPED["cases"]], dropped),
    }


if __name__ == "__main__":
    measure_page(__doc__, PAGE, tables)
