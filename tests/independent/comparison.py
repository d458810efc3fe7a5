"""Holds escort_mj's verdicts against the watcher's.

`python -m tests.independent.comparison [group or variation ...]` prints a table of the differences.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from escort_mj import mission
from escort_mj.record.outcome import Outcome
from escort_mj.scenario.reader.load import parse_scenario
from tests.independent.flight import Flight, fly
from tests.independent.variations import EVERY, Keys, Variation
from tests.independent.watcher import clearance, inside, judge, metric, touches, tunneling

HAIR = 1e-4  # between a distance and its bounds [m]
SHARE = 1e-3  # between a share and its bounds
EXACT = 2e-6  # MuJoCo's tolerance where two shapes have no closed form [m]
NEVER = 1e3  # a distance that nothing comes to [m]


class Row(NamedTuple):
    """One expectation, what the watcher found, and what escort_mj did."""

    variation: str
    expectation: str
    held: bool | None
    value: float | None
    their_held: bool
    their_value: float | None
    most: float | None = None

    @property
    def differs(self) -> bool:
        """Whether verdicts or values differ."""
        if self.held is not None and self.held != self.their_held:
            return True
        if self.value is None or self.value == self.their_value:
            return False
        if self.their_value is None:
            return True
        most = self.value if self.most is None else self.most
        slack = max(EXACT, SHARE * abs(most)) if "tunneling" in self.expectation else EXACT
        return not self.value - slack <= self.their_value <= most + slack


def compare(variation: Variation) -> list[Row]:
    """Fly a variation with both, and return a row for every expectation, and one for how it was flown."""
    text = json.dumps(variation.keys)
    flight = fly(parse_scenario(text))
    asked = list(expectations(flight, variation.questions))
    flight.scenario = parse_scenario(json.dumps(variation.keys | {"expect": asked}))
    run = mission.fly(flight.scenario)
    rows = [Row(variation.name, "ended in order", True, None, run.outcome is Outcome.COMPLETED, None)]
    rows += [
        Row(variation.name, what, True, None, held, None) for what, held in _flown_alike(flight, run.trace)
    ]
    for place, (asked_for, one) in enumerate(zip(asked, flight.scenario.expect, strict=True)):
        theirs = next(verdict for verdict in run.verdicts if verdict.expectation == place)
        mine = judge(flight, one)
        value = theirs.value if mine.value is not None else None
        rows.append(
            Row(variation.name, _words(asked_for), mine.held, mine.value, theirs.held, value, mine.most)
        )
    return rows


def _flown_alike(flight: Flight, trace: Any) -> Iterator[tuple[str, bool]]:
    """Whether robots and target were where the trace says, and where MuJoCo's geometry has them."""
    steps = np.rint(trace.time.values / flight.timestep).astype(int)
    count, axes = trace.q.shape[1:]
    robots = flight.centers[steps, :count, :axes]
    yield "robots are where the trace says", bool(np.abs(robots - trace.q.values).max() < 1e-12)
    if flight.is_led:
        led = flight.centers[:, flight.names.index("target")]
        places = trace.target_position.values
        yield "the target is where the trace says", bool(np.abs(led[steps, :axes] - places).max() < 1e-8)
        if axes <= 3:
            yield "the target's geometry is there", bool(np.abs(led - flight.shown).max() < 1e-8)


def expectations(flight: Flight, questions: Sequence[Keys]) -> Iterator[Keys]:
    """Return every question with bounds at either side of its true value."""
    for question in questions:
        window = question.get("after", 0.0), question.get("before")
        if "clearance" in question:
            value = clearance(flight, question["clearance"], *window)
            for bound in {max(each, 0.0) for each in around(value, HAIR)}:
                yield question | {"at_least": bound}
        elif "sanity" in question or question.get("contacts") == "none":
            yield question
        elif "contacts" in question:
            yield from _touches(flight, question, window)
        elif question["metric"] == "contacts":
            count = metric(flight, "contacts", *window)
            yield from (question | {"at_most": bound} for bound in (count - 1.0, count) if bound >= 0.0)
        elif question["metric"] == "tunneling":
            least, most = tunneling(flight, *window)
            yield question | {"at_most": (1.0 - SHARE) * least}
            yield question | {"at_most": (1.0 + SHARE) * most}
        else:
            value = metric(flight, question["metric"], *window)
            yield from (question | {"at_least": bound} for bound in around(value, HAIR))


def around(value: float, hair: float) -> tuple[float, ...]:
    """Return a bound below a value and one above."""
    return (value - hair, value + hair) if math.isfinite(value) else (NEVER,)


def _touches(flight: Flight, question: Keys, window: tuple[float, float | None]) -> Iterator[Keys]:
    found = touches(flight, question["contacts"], *window)
    asked = {key: value for key, value in question.items() if key != "of"}
    if question["of"] == "count":
        yield asked
        yield from (asked | {"at_most": most} for most in (len(found) - 1, len(found)) if most >= 0)
        yield from (asked | {"at_least": least} for least in (len(found), len(found) + 1))
    elif found and question["of"] == "touch_time":
        longest = max(inside(flight, touch, *window) for touch in found)
        yield from (asked | {"touch_time": max(each, 0.0)} for each in around(longest, 0.4 * flight.timestep))
    elif found:
        deepest = max(touch.depth for touch in found)
        yield from (asked | {"penetration": each} for each in around(deepest, min(HAIR, 0.1 * deepest)))


def _words(expectation: Keys) -> str:
    return " ".join(f"{key}={value}" for key, value in expectation.items())


def main(names: Sequence[str]) -> int:
    """Print the table of differences, and how many there are."""
    total = differ = 0
    for group, variation in EVERY:
        if names and not any(name in (group, variation.name) for name in names):
            continue
        rows = compare(variation)
        wrong = [row for row in rows if row.differs]
        total, differ = total + len(rows), differ + len(wrong)
        print(f"{group}: {variation.name}: {len(wrong)} of {len(rows)} differ")
        for row in wrong:
            mine, theirs = (row.held, row.value), (row.their_held, row.their_value)
            print(f"    {row.expectation:70} {mine!s:32} they: {theirs!s}")
    print(f"{differ} of {total} differ")
    return int(differ > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
