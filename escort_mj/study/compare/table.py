"""The table of the reproduction, as data and as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from escort_mj.record.tables import markdown as markdown_rows
from escort_mj.record.window import WORDS
from escort_mj.study.compare.claims import CLAIMS, PRECISION, SPEED, Runs, better, verdict
from escort_mj.study.compare.measured import NEAR, QUANTITIES, Measured
from escort_mj.study.compare.reproduction import CASES, LAWS, READINGS
from escort_mj.study.sweeps.quantities import value_text

SHORT = {True: "yes", False: "no", None: "-"}
VERSUS = ["case", "reading", "faster", "times", "more precise", "tail errors"]
HEADS = {
    "settling_time": "settles",
    "tracking_time": "tracks",
    "error_peak": "peak of e",
    "radius_error": "radius",
    "radius_error_max": "radius, worst",
    "spacing_error": "spacing",
    "e_rms": "rms e",
    "e_dot_rms": "rms e_dot",
    "true_e_rms": "rms e, no noise",
    "true_e_dot_rms": "rms e_dot, no noise",
    "chattering": "chattering",
    "force_rms": "force",
    "obstacle_distance": "to obstacles",
    "robot_distance": "between robots",
    "contacts": "touches",
}


def claims_document(runs: Sequence[Measured]) -> dict[str, Any]:
    """Everything that was measured and what it says of each claim, as JSON can hold it."""
    readings = by_reading(runs)
    claims = []
    for claim in CLAIMS:
        findings = {reading: claim(readings[reading]) for reading in READINGS}
        claims.append(
            {
                "section": claim.section,
                "figures": claim.figures,
                "claim": claim.words,
                "rule": claim.rule,
                "readings": {name: finding._asdict() for name, finding in findings.items()},
                "holds": verdict(findings),
            }
        )
    return {
        "readings": {name: reading.words for name, reading in READINGS.items()},
        "quantities": {name: quantity._asdict() for name, quantity in QUANTITIES.items()},
        "claims": claims,
        "comparison": [
            _compared(case, readings[reading], reading, other)
            for other in LAWS
            if other != "apd_smc"
            for case in CASES
            for reading in READINGS
        ],
        "runs": [
            {
                "name": run.simulation.name,
                **run.simulation._asdict(),
                "outcome": run.outcome,
                "message": run.message,
                "values": run.values,
                "approaches": [approach._asdict() for approach in run.approaches],
            }
            for run in runs
        ],
    }


def by_reading(runs: Iterable[Measured]) -> dict[str, Runs]:
    """Runs by reading, then by case and law."""
    found: dict[str, dict[tuple[str, str], Measured]] = {reading: {} for reading in READINGS}
    for run in runs:
        found[run.simulation.reading][run.simulation.case, run.simulation.law] = run
    return dict(found)


def _compared(case: str, runs: Runs, reading: str, other: str) -> dict[str, Any]:
    """Whether APD-SMC is faster and more precise than another law in one case, in one reading."""
    ours, theirs = runs.get((case, "apd_smc")), runs.get((case, other))
    answers: dict[str, bool | None] = {"faster": None, "more_precise": None}
    if ours is not None and theirs is not None:
        answers = {"faster": better(ours, theirs, SPEED), "more_precise": better(ours, theirs, PRECISION)}
    return {"case": case, "reading": reading, "than": other, **answers}


def claims_markdown(runs: Sequence[Measured]) -> str:
    """The table for people."""
    facts = claims_document(runs)
    readings = list(READINGS)
    words = [READINGS[reading].words for reading in readings]
    lines = [
        "# The paper's simulations, reproduced",
        "",
        "This page compares each claim of the paper with simulations. `escort-mj reproduce --docs",
        "docs/reproduction.md` generates it; do not edit it.",
        "",
        "The runs cover all cases of section 5 of Gao, Song, Li, *Appl. Sci.* 2019, 9(19), 4144, with",
        "MuJoCo's physics, disturbances and measurement noise (one seed, 0). What the paper says about the",
        f"force limit can be read in three ways: {'; '.join(f'*{one}*' for one in words)}.",
        "In cases with obstacles, the times, the tail and the peak refer to the part of a run before",
        f"an obstacle first comes within {NEAR:g} safe distances of a robot; in the other cases, they",
        f"refer to the whole run. The tail is the {WORDS['tail']} of this part or run. Where the",
        "printed paper lost a sign, the files in `scenarios/paper/` state which sign they use. The",
        "readings *as printed* use the avoidance gain as eq. 24 prints it, the third one the gain that",
        "eq. 23 requires ([derivation](equations.md#eqs-23-and-24)).",
        "",
        "## Claims of the paper",
        "",
        "The claims are paraphrased. The column `rule` states when a claim holds. In a pair of values, the",
        "first belongs to APD-SMC and the second to ASMC.",
        "",
        *markdown_rows(
            ["section", "figures", "claim", "holds", "rule", *words], _claim_rows(facts["claims"])
        ),
        "",
        "## Is APD-SMC faster and more precise than ASMC?",
        "",
        "Values are given as APD-SMC / ASMC. In the column `times`, the first pair of values is the settling",
        "time of the formation, the second the time until the references are tracked. The tail errors",
        "are those of the radius, the RMS of |e| and the RMS of |e_dot|.",
        "",
        *markdown_rows(VERSUS, _versus(runs, "asmc")),
        "",
        "## Does the adaptation help?",
        "",
        "PD-SMC is APD-SMC without adaptation. Values are given as APD-SMC / PD-SMC.",
        "",
        *markdown_rows(VERSUS, _versus(runs, "pd_smc")),
        "",
        "## All measurements",
        "",
        "Here, q and v are the position and the velocity of a robot, q_d and v_d their references,",
        "e = q_d - q and e_dot = v_d - v with measured q and v, c is the position of the target, and R is",
        "the radius of the formation. With anti-windup, q_d moves with the robot while a motor saturates,",
        "so q_d is not the integral of v_d as in the paper: |e|, the tracking time and the peak of e are",
        "then not the quantities of its figures 5c to 15c. ASMC saturates most of the time; its |e| is the",
        "least alike.",
        "",
    ]
    lines += [f"- {HEADS[name]} [{q.unit}]: {q.meaning}" for name, q in QUANTITIES.items()]
    for reading in readings:
        lines += ["", f"### {READINGS[reading].words[0].upper()}{READINGS[reading].words[1:]}", ""]
        lines += markdown_rows(
            ["case", "law", "outcome", *HEADS.values()], _run_rows(by_reading(runs)[reading])
        )
    return "\n".join(lines) + "\n"


def claims_summary(runs: Sequence[Measured]) -> list[str]:
    """Return the claims and whether they hold, one line each, for a terminal."""
    return [
        f"  {claim['holds']:9} {claim['section']:6} {claim['claim']}"
        for claim in claims_document(runs)["claims"]
    ]


def _claim_rows(claims: Iterable[dict[str, Any]]) -> Iterator[list[str]]:
    for claim in claims:
        cells = []
        for finding in claim["readings"].values():
            answer = "" if finding["holds"] is None else SHORT[finding["holds"]] + ": "
            cells.append(answer + finding["measured"])
        yield [
            claim["section"],
            claim["figures"],
            claim["claim"],
            f"**{claim['holds']}**",
            claim["rule"],
            *cells,
        ]


def _versus(runs: Iterable[Measured], other: str) -> Iterator[list[str]]:
    readings = by_reading(runs)
    for case in CASES:
        for reading, words in READINGS.items():
            ours = readings[reading].get((case, "apd_smc"))
            theirs = readings[reading].get((case, other))
            if ours is None or theirs is None:
                yield [CASES[case], words.words, "-", "not run", "-", "not run"]
                continue
            yield [
                CASES[case],
                words.words,
                SHORT[better(ours, theirs, SPEED)],
                _pairs(ours, theirs, SPEED),
                SHORT[better(ours, theirs, PRECISION)],
                _pairs(ours, theirs, PRECISION),
            ]


def _pairs(ours: Measured, theirs: Measured, names: Iterable[str]) -> str:
    """Both runs' values, or who did not reach the end."""
    lost = [f"{LAWS[run.simulation.law]} {run.outcome}" for run in (ours, theirs) if not run.completed]
    if lost:
        return ", ".join(lost)
    both = [[value_text(run.values[name], QUANTITIES[name].unit) for run in (ours, theirs)] for name in names]
    return "; ".join(" / ".join(pair) for pair in both)


def _run_rows(runs: Runs) -> Iterator[list[str]]:
    for run in runs.values():
        values = [value_text(run.values[name], quantity.unit) for name, quantity in QUANTITIES.items()]
        outcome = run.outcome if run.completed else f"{run.outcome}: {run.message}"
        yield [CASES[run.simulation.case], LAWS[run.simulation.law], outcome, *values]
