"""Straight lines plus sinusoids: what most functions of time are, evaluated eight tones at once.

A target on a circle and a disturbance along p axes are 3p sines and cosines in every step, each a call of
its own. So programs that come down to

    c + d t + sum_j [a_j cos(w_j t + f_j) + b_j sin(w_j t + f_j)]

are taken apart once, when they are packed, and all axes share the tones (w_j, f_j). Programs of another
kind are left to `program`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Annotated, NamedTuple

import numpy as np

from escort_mj.native.fields import Array, Fields, Value
from escort_mj.native.kernels import flat, inlined
from escort_mj.native.lanes import WIDTH, copy_numbers, everywhere, load, room_for, set_row, stack_rows, store
from escort_mj.numerics.elementary import sine_and_cosine
from escort_mj.numerics.program import Op
from escort_mj.plan import Plan

Tone = tuple[float, float]  # pulsatance [rad/s] and phase [rad]


class HarmonicParameters(Fields):
    """Tables of what target and disturbance do, see `tabulate`."""

    lines: Annotated[Array, 2, "followed", Value("1", "values at 0 and slopes")]
    tones: Annotated[Array, 2, "tones", Value("rad/s and rad", "pulsatances and phases")]
    waves: Annotated[Array, "waves", "followed", Value("1", "shares of cosine and sine of each tone")]


class Sum(NamedTuple):
    """A straight line plus sinusoids.

    Attributes:
        constant: c.
        slope: d.
        waves: a_j and b_j of each tone.
    """

    constant: float
    slope: float
    waves: Mapping[Tone, tuple[float, float]]

    def plus(self, other: Sum, sign: float) -> Sum:
        """This one and so many times the other one."""
        waves: dict[Tone, tuple[float, float]] = defaultdict(lambda: (0.0, 0.0), self.waves)
        for tone, (a, b) in other.waves.items():
            waves[tone] = waves[tone][0] + sign * a, waves[tone][1] + sign * b
        return Sum(self.constant + sign * other.constant, self.slope + sign * other.slope, waves)

    def times(self, factor: float) -> Sum:
        """A multiple."""
        waves = {tone: (a * factor, b * factor) for tone, (a, b) in self.waves.items()}
        return Sum(self.constant * factor, self.slope * factor, waves)


def sum_of(code: Array) -> Sum | None:
    """What a program comes down to; None where that is no straight line plus sinusoids.

    Args:
        code: Its instructions, shape (count, INSTRUCTION_SIZE); none are those of 0.
    """
    stack: list[Sum] = [] if len(code) else [Sum(0.0, 0.0, {})]
    for number, a, b in code:
        op = Op(int(number))
        if op in (Op.CONSTANT, Op.AFFINE):
            stack.append(Sum(a, b, {}))
            continue
        if op == Op.PIECEWISE:
            return None
        x = stack.pop()
        if op in (Op.ADD, Op.SUBTRACT):
            stack.append(stack.pop().plus(x, 1.0 if op == Op.ADD else -1.0))
        elif op == Op.SHIFT:
            stack.append(x._replace(constant=x.constant + a))
        elif op == Op.SCALE:
            stack.append(x.times(a))
        elif op in (Op.SIN, Op.COS) and not x.waves:
            wave = (0.0, 1.0) if op == Op.SIN else (1.0, 0.0)
            stack.append(Sum(0.0, 0.0, {(x.slope, x.constant): wave}))
        else:
            return None
    return stack[0]


def tabulate(sums: Sequence[Sum | None]) -> dict[str, Array]:
    """Tables of what target and disturbance do, as `follow` reads them; what is None stays 0.

    Args:
        sums: Of the target's p axes, then of the disturbance's.

    Returns:
        `tones`, pulsatances and phases, shape (2, tones), filled up to whole lanes.
        The others have a column for each of the target's coordinates, its velocities and the disturbance's
        forces, filled up to whole lanes: `lines`, value at 0 and slope, shape (2, followed), and `waves`,
        shares of cosine and sine of each tone, filled up to pairs of tones, shape (waves, followed).
    """
    p, tones = len(sums) // 2, list(dict.fromkeys(tone for each in sums if each for tone in each.waves))
    room, followed, pairs = room_for(len(tones)), room_for(3 * p), len(tones) + len(tones) % 2
    lines, waves = np.zeros((2, followed)), np.zeros((pairs, 2, followed))
    for k, each in enumerate(sums):
        if each is None:
            continue
        place = k if k < p else k + p  # velocities stand between
        lines[:, place] = each.constant, each.slope
        for tone, shares in each.waves.items():
            waves[tones.index(tone), :, place] = shares
        if k < p:
            lines[0, p + k] = each.slope
            for tone, (a, b) in each.waves.items():
                waves[tones.index(tone), :, p + k] = tone[0] * b, -tone[0] * a
    table = np.zeros((2, room))
    table[:, : len(tones)] = np.reshape(tones, (-1, 2)).T
    return {"lines": lines, "tones": table, "waves": waves.reshape(2 * pairs, followed)}


@inlined
def follow(plan: Plan, time: float, position: Array, velocity: Array, push: Array) -> None:
    """Writes how far target and disturbance are straight lines plus sinusoids: 0 where they are not.

    Args:
        plan: Gives the tables.
        time: At which [s].
        position: Result: the target's, shape (p,) [m].
        velocity: Result: the target's, shape (p,) [m/s].
        push: Result: the disturbance, shape (p,) [N].
    """
    p, count = position.shape[0], plan.tones.shape[1]
    followed, shares = plan.lines.shape[1], plan.waves.shape[0] // 2
    turns, found = stack_rows(2), stack_rows(followed // WIDTH)
    for at in range(0, followed, WIDTH):
        store(found, at, load(plan.lines, at) + time * load(plan.lines, followed + at))
    for first in range(0, count, WIDTH):
        sine, cosine = sine_and_cosine(load(plan.tones, first) * time + load(plan.tones, count + first))
        set_row(turns, 0, cosine)
        set_row(turns, 1, sine)
        for at in range(0, followed, WIDTH):
            a, b, c, d = load(found, at), everywhere(0.0), everywhere(0.0), everywhere(0.0)
            for lane in range(0, min(WIDTH, shares - first), 2):  # four sums: none waits long for itself
                row = 2 * (first + lane) * followed + at
                a = a + turns[0, lane] * load(plan.waves, row)
                b = b + turns[1, lane] * load(plan.waves, row + followed)
                c = c + turns[0, lane + 1] * load(plan.waves, row + 2 * followed)
                d = d + turns[1, lane + 1] * load(plan.waves, row + 3 * followed)
            store(found, at, (a + b) + (c + d))
    values = flat(found)
    copy_numbers(values[:p], position, p)
    copy_numbers(values[p : 2 * p], velocity, p)
    copy_numbers(values[2 * p :], push, p)
