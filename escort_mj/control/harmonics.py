"""Straight lines plus sinusoids: what most functions of time are, evaluated four tones at once.

A target on a circle and a disturbance along p axes are 3p sines and cosines in every step, each a call of
its own. So programs that come down to

    c + d t + sum_j [a_j cos(w_j t + f_j) + b_j sin(w_j t + f_j)]

are taken apart once, when they are packed, and all axes share the tones (w_j, f_j). Programs of another
kind are left to `program`.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from escort_mj.control.elementary import sine_and_cosine
from escort_mj.control.plan import Plan, State
from escort_mj.control.program import Op
from escort_mj.kernels import inlined
from escort_mj.lanes import WIDTH, load, total

Array = NDArray[np.float64]
Tone = tuple[float, float]  # pulsatance [rad/s] and phase [rad]


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
    """Tables of several functions as `follow` reads them; those of None are 0.

    Returns:
        `lines`, constant and slope of each, shape (functions, 2); `tones`, pulsatances and phases, shape
        (2, tones); `waves`, shares of cosine and sine in each, shape (functions * 2, tones). Tones are filled
        up to whole lanes with such as nobody has.
    """
    tones = list(dict.fromkeys(tone for each in sums if each for tone in each.waves))
    room = math.ceil(len(tones) / WIDTH) * WIDTH
    lines, waves = np.zeros((len(sums), 2)), np.zeros((len(sums), 2, room))
    for row, each in enumerate(sums):
        if each is None:
            continue
        lines[row] = each.constant, each.slope
        for tone, shares in each.waves.items():
            waves[row, :, tones.index(tone)] = shares
    table = np.zeros((2, room))
    table[:, : len(tones)] = np.reshape(tones, (-1, 2)).T
    return {"lines": lines, "tones": table, "waves": waves.reshape(2 * len(sums), room)}


@inlined
def follow(plan: Plan, state: State, push: Array) -> None:
    """Writes how far target and disturbance are straight lines plus sinusoids: 0 where they are not.

    Args:
        plan: Gives the tables, first of the target's axes, then of the disturbance's.
        state: Gives the time; the target's position and velocity are written.
        push: Result: the disturbance, shape (p,) [N].
    """
    p, count, time = state.q.shape[1], plan.tones.shape[1], state.time[0]
    for k in range(p):
        state.target_position[k] = plan.lines[k, 0] + plan.lines[k, 1] * time
        state.target_velocity[k] = plan.lines[k, 1]
        push[k] = plan.lines[p + k, 0] + plan.lines[p + k, 1] * time
    for at in range(0, count, WIDTH):
        rate = load(plan.tones, at)
        sine, cosine = sine_and_cosine(rate * time + load(plan.tones, count + at))
        for k in range(p):
            a, b = load(plan.waves, 2 * k * count + at), load(plan.waves, (2 * k + 1) * count + at)
            state.target_position[k] += total(a * cosine + b * sine)
            state.target_velocity[k] += total(rate * (b * cosine - a * sine))
            a = load(plan.waves, 2 * (p + k) * count + at)
            b = load(plan.waves, (2 * (p + k) + 1) * count + at)
            push[k] += total(a * cosine + b * sine)
