"""What the paper says of its simulations, in our words, and by which rule each claim holds or not.

A rule looks at the runs of one reading and computes whether the claim holds in it; None where this reading
has nothing to say, or a run is missing. Nothing here is typed in from results.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from escort_mj.study.compare.measured import Measured
from escort_mj.study.compare.reproduction import CASES, LAWS, READINGS
from escort_mj.study.sweeps.quantities import value_text

Runs = Mapping[tuple[str, str], Measured]
"""The runs of one reading, by case and law."""

EVEN = 0.01  # of the radius, or of the distance between neighbors: "fixed", "evenly"
KEPT = 0.05  # of the same: an escort on the move that lags, but holds
MARGIN = 0.05  # by which two values must differ to count as different
MUCH = 2.0  # times: "much worse"
RADIUS, SAFE = 5.0, 2.0  # of every case of the paper [m]
NOISE = 0.04  # twice the bound of the position noise: how far into the safe distance noise alone may lead [m]

SPEED = ("settling_time", "tracking_time")
PRECISION = ("radius_error", "e_rms", "e_dot_rms")


class Conclusion(NamedTuple):
    """What a rule found in one reading.

    Attributes:
        holds: Whether the claim holds; None where this reading does not decide it.
        measured: The numbers that decide it, in words.
    """

    holds: bool | None
    measured: str


class Claim(NamedTuple):
    """One claim of the paper.

    Attributes:
        section: Of the paper.
        figures: Of the paper.
        words: The claim, in our words.
        rule: When it holds, in words.
        decide: The rule.
    """

    section: str
    figures: str
    words: str
    rule: str
    decide: Callable[[Runs], Conclusion]

    def __call__(self, runs: Runs) -> Conclusion:
        """The finding in one reading; undecided where a run that it takes is missing."""
        try:
            return self.decide(runs)
        except KeyError as missing:
            case, law = missing.args[0]
            return Conclusion(None, f"{LAWS[law]} in {CASES[case]} has not run")


def better(first: Measured, second: Measured, names: tuple[str, ...]) -> bool:
    """Whether a run is better than another: in one of these values at least, and in none of them worse.

    The less the better. Values closer than `MARGIN` count as equal. A run that did not reach its end is
    never better, and any that did is better than it.
    """
    if not first.completed or not second.completed:
        return first.completed
    pairs = [(first.value(name), second.value(name)) for name in names]
    return any(a < b * (1 - MARGIN) for a, b in pairs) and not any(a * (1 - MARGIN) > b for a, b in pairs)


def formation(case: str, tolerance: float) -> Callable[[Runs], Conclusion]:
    """Rule: APD-SMC ends with radius and spacing within a share of what they should be."""

    def decide(runs: Runs) -> Conclusion:
        run = runs[case, "apd_smc"]
        if not run.completed:
            return Conclusion(False, _ended(run))
        radius, spacing = run.value("radius_error"), run.value("spacing_error")
        worst = value_text(run.values["radius_error_max"], "m")
        words = (
            f"tail errors: radius {value_text(radius, 'm')} (at most {worst}), "
            f"spacing {value_text(spacing, 'm')}"
        )
        return Conclusion(max(radius, spacing) <= tolerance * RADIUS, words)

    return decide


def compared(case: str, names: tuple[str, ...], units: tuple[str, ...]) -> Callable[[Runs], Conclusion]:
    """Rule: APD-SMC is better than ASMC in these values."""

    def decide(runs: Runs) -> Conclusion:
        ours, theirs = runs[case, "apd_smc"], runs[case, "asmc"]
        return Conclusion(better(ours, theirs, names), _pairs(ours, theirs, names, units))

    return decide


def much_worse(case: str) -> Callable[[Runs], Conclusion]:
    """Rule: ASMC's error of position or velocity is at least `MUCH` times APD-SMC's; it is less precise."""

    def decide(runs: Runs) -> Conclusion:
        ours, theirs = runs[case, "apd_smc"], runs[case, "asmc"]
        if not ours.completed or not theirs.completed:
            return Conclusion(ours.completed, _pairs(ours, theirs, (), ()))
        names = ("true_e_rms", "e_dot_rms", "chattering")
        times = [theirs.value(name) / max(ours.value(name), 1e-12) for name in names]
        words = "ASMC / APD-SMC: |e| without noise {:.2g}, |e_dot| {:.2g}, chattering {:.2g}".format(*times)
        return Conclusion(max(times[:2]) >= MUCH and better(ours, theirs, PRECISION), words)

    return decide


def better_everywhere(
    names: tuple[str, ...], terms: tuple[str, ...], what: str
) -> Callable[[Runs], Conclusion]:
    """Rule: APD-SMC is better than ASMC in every case; the words count each value by itself as well."""

    def decide(runs: Runs) -> Conclusion:
        def wins(some: tuple[str, ...]) -> int:
            return sum(better(runs[case, "apd_smc"], runs[case, "asmc"], some) for case in CASES)

        each = ", ".join(f"by {words} in {wins((name,))}" for name, words in zip(names, terms, strict=True))
        return Conclusion(wins(names) == len(CASES), f"{what} in {wins(names)} of {len(CASES)} cases; {each}")

    return decide


def avoids(case: str) -> Callable[[Runs], Conclusion]:
    """Rule: no touch, and no robot farther inside the safe distance than noise explains."""

    def decide(runs: Runs) -> Conclusion:
        run = runs[case, "apd_smc"]
        if not run.completed:
            return Conclusion(False, _ended(run))
        obstacle, robot = run.value("obstacle_distance"), run.value("robot_distance")
        words = (
            f"minimum distance to an obstacle {value_text(obstacle, 'm')}, "
            f"between robots {value_text(robot, 'm')};"
            f" {value_text(run.value('contacts'), '1')} touches"
        )
        return Conclusion(run.value("contacts") == 0 and min(obstacle, robot) >= SAFE - NOISE, words)

    return decide


def meets(case: str) -> Callable[[Runs], Conclusion]:
    """No rule: who avoids which obstacle. Signs of positions that the text lost were chosen by that."""

    def decide(runs: Runs) -> Conclusion:
        run = runs[case, "apd_smc"]
        if not run.completed:
            return Conclusion(False, _ended(run))
        words = [
            f"obstacle {index}: robot {near.robot} closest, avoidance active for"
            f" {'robot ' + ', '.join(map(str, near.avoided)) if near.avoided else 'no robot'}"
            for index, near in enumerate(run.approaches, 1)
        ]
        return Conclusion(None, "; ".join(words))

    return decide


def saturates(runs: Runs) -> Conclusion:
    """Rule: APD-SMC completes every case; undecided without a force limit."""
    every = [runs[case, "apd_smc"] for case in CASES]
    if any(run.simulation.reading == "unlimited" for run in every):
        return Conclusion(None, "no limit in this reading")
    lost = [CASES[run.simulation.case] for run in every if not run.completed]
    words = f"completes {len(every) - len(lost)} of {len(every)} cases"
    return Conclusion(not lost, words + (f"; incomplete: {'; '.join(lost)}" if lost else ""))


def avoids_better(runs: Runs) -> Conclusion:
    """Rule: APD-SMC touches nothing and keeps one obstacle farther away than ASMC does, and none nearer."""
    words, ahead, behind = [], False, False
    for case in ("case2_2d_obstacles", "case3_3d_obstacle"):
        ours, theirs = runs[case, "apd_smc"], runs[case, "asmc"]
        words.append(_pairs(ours, theirs, ("obstacle_distance",), ("m",)))
        behind |= not ours.completed or ours.value("contacts") > 0
        if ours.completed and theirs.completed:
            gain = ours.value("obstacle_distance") - theirs.value("obstacle_distance")
            ahead, behind = ahead or gain > NOISE, behind or gain < -NOISE
        elif ours.completed:
            ahead = True
    return Conclusion(ahead and not behind, "; ".join(words))


def _ended(run: Measured) -> str:
    return f"{LAWS[run.simulation.law]} {run.outcome}: {run.message}"


def _pairs(ours: Measured, theirs: Measured, names: tuple[str, ...], units: tuple[str, ...]) -> str:
    """Two runs' values side by side, or who did not reach the end."""
    if not ours.completed or not theirs.completed:
        return "; ".join(_ended(run) for run in (ours, theirs) if not run.completed)
    both = [
        f"{value_text(ours.values[name], unit)} / {value_text(theirs.values[name], unit)}"
        for name, unit in zip(names, units, strict=True)
    ]
    return ", ".join(both)


def faster(case: str) -> Callable[[Runs], Conclusion]:
    """Rule: APD-SMC settles and tracks no later than ASMC, and one of both sooner."""
    return compared(case, SPEED, ("s", "s"))


def more_precise(case: str) -> Callable[[Runs], Conclusion]:
    """Rule: APD-SMC's tail errors are none larger than ASMC's, and one of them smaller."""
    return compared(case, PRECISION, ("m", "m", "m/s"))


_STAYS = f"mean tail errors of radius and spacing at most {100 * EVEN:g} % of R"
_HOLDS = f"mean tail errors of radius and spacing at most {100 * KEPT:g} % of R"
_FARTHER = f"no touch, distance to one obstacle larger by {1000 * NOISE:g} mm, to none smaller"
_CLEAR = f"no touch, and no distance below {SAFE - NOISE:g} m (safe distance 2 m minus noise)"
_FASTER = f"settling or tracking time shorter by {100 * MARGIN:g} %, neither longer"
_MUCH_WORSE = f"|e| without noise or |e_dot| at least {MUCH:g} times that of APD-SMC, and less precise"
_PRECISE = f"one tail error (radius, |e|, |e_dot|) smaller by {100 * MARGIN:g} %, none larger"

CLAIMS = (
    Claim(
        "5",
        "5 to 17",
        "The missions succeed although forces saturate at 10 N",
        "APD-SMC completes every case",
        saturates,
    ),
    Claim(
        "5.1.1",
        "5",
        "Robots keep their distance to a target at rest and surround it evenly",
        _STAYS,
        formation("case1_2d", EVEN),
    ),
    Claim("5.1.1", "5, 6", "ASMC performs much worse", _MUCH_WORSE, much_worse("case1_2d")),
    Claim("5.1.1", "5, 6", "APD-SMC converges faster than ASMC", _FASTER, faster("case1_2d")),
    Claim("5.1.1", "5, 6", "APD-SMC is more precise than ASMC", _PRECISE, more_precise("case1_2d")),
    Claim(
        "5.1.2",
        "7",
        "It also works in space: the robots form an octahedron around a target at rest",
        _STAYS,
        formation("case1_3d", EVEN),
    ),
    Claim(
        "5.2.1",
        "8",
        "The team escorts a target at constant velocity in the plane",
        _HOLDS,
        formation("case2_2d", KEPT),
    ),
    Claim(
        "5.2.1",
        "9, 10",
        "Obstacles enter the safe distance of robots 1 and 4",
        "not judged: signs of positions that the printed text lost were chosen so that it holds",
        meets("case2_2d_obstacles"),
    ),
    Claim(
        "5.2.1", "9, 10", "Robots avoid both obstacles and each other", _CLEAR, avoids("case2_2d_obstacles")
    ),
    Claim(
        "5.2.2",
        "11, 12",
        "The team escorts a target at constant velocity in space",
        _HOLDS,
        formation("case2_3d", KEPT),
    ),
    Claim("5.2.2", "12, 13", "ASMC converges more slowly", _FASTER, faster("case2_3d")),
    Claim("5.2.2", "12, 13", "ASMC is less precise", _PRECISE, more_precise("case2_3d")),
    Claim(
        "5.3.1",
        "14, 15",
        "The team escorts a target of changing velocity in the plane",
        _HOLDS,
        formation("case3_2d", KEPT),
    ),
    Claim(
        "5.3.2",
        "16, 17",
        "The team escorts such a target in space past an obstacle",
        _CLEAR,
        avoids("case3_3d_obstacle"),
    ),
    Claim(
        "5.3.2",
        "5 to 17",
        "Overall, APD-SMC is faster than ASMC",
        _FASTER + ", in every case",
        better_everywhere(SPEED, ("settling time", "tracking time"), "faster"),
    ),
    Claim(
        "5.3.2",
        "5 to 17",
        "Overall, APD-SMC performs better than ASMC",
        _PRECISE + ", in every case",
        better_everywhere(PRECISION, ("radius", "|e|", "|e_dot|"), "more precise"),
    ),
    Claim(
        "5.3.2",
        "9, 10, 16, 17",
        "APD-SMC is superior to ASMC in avoiding obstacles",
        _FARTHER,
        avoids_better,
    ),
)


def verdict(findings: Mapping[str, Conclusion]) -> str:
    """What a claim's findings come to: `yes`, `no`, `not in` or `only in` some readings, `undecided`."""
    decided = {reading: finding.holds for reading, finding in findings.items() if finding.holds is not None}
    holding = [READINGS[reading].words for reading, holds in decided.items() if holds]
    failing = [READINGS[reading].words for reading, holds in decided.items() if not holds]
    if not decided:
        return "undecided"
    if not failing or not holding:
        return "no" if failing else "yes"
    if len(holding) < len(failing):
        return "only in: " + "; ".join(holding)
    return "not in: " + "; ".join(failing)
