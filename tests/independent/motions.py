"""Where a scenario says that a body is: expressions and waypoints, evaluated apart from escort_mj."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]

FUNCTIONS: dict[str, Callable[..., Array]] = {
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "tanh": np.tanh, "exp": np.exp, "log": np.log,
    "sqrt": np.sqrt, "abs": np.abs, "min": np.minimum, "max": np.maximum,
}  # fmt: skip
OPERATORS: dict[type, Callable[..., Array]] = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide, ast.Pow: np.power,
    ast.USub: np.negative, ast.UAdd: np.positive,
}  # fmt: skip


def positions(motion: Mapping[str, Any], axes: int, times: Array) -> Array:
    """Return where a body is at each time, shape (times, axes) [m].

    Args:
        motion: `position`, or `waypoints` and `interpolation`, as in a scenario; neither: it rests at 0.
        axes: Number of axes.
        times: Shape (k,) [s].
    """
    if (waypoints := motion.get("waypoints")) is not None:
        return _through(waypoints, motion.get("interpolation", "linear"), times)
    given = motion.get("position")
    return np.stack([expression(each, times) for each in ([0.0] * axes if given is None else given)], axis=1)


def expression(source: float | str, times: Array) -> Array:
    """Return the value of a number or of an expression in t at each time, shape (k,)."""
    tree = ast.parse(str(source).strip(), mode="eval").body
    return np.broadcast_to(np.asarray(_value(tree, times), dtype=float), times.shape).copy()


def _value(node: ast.expr, t: Array) -> Array:
    match node:
        case ast.Constant(value=value):
            return np.asarray(float(value))  # type: ignore[arg-type]
        case ast.Name(id="t"):
            return t
        case ast.Name(id="pi"):
            return np.asarray(np.pi)
        case ast.UnaryOp(op=op, operand=operand):
            return OPERATORS[type(op)](_value(operand, t))
        case ast.BinOp(left=left, op=op, right=right):
            return OPERATORS[type(op)](_value(left, t), _value(right, t))
        case ast.Call(func=ast.Name(id=name), args=args):
            return FUNCTIONS[name](*(_value(each, t) for each in args))
    raise ValueError(f"no expression: {ast.dump(node)}")


def _through(waypoints: Sequence[Mapping[str, Any]], interpolation: str, times: Array) -> Array:
    """Return the way through waypoints; it rests before the first and after the last."""
    moments = np.array([each["time"] for each in waypoints], dtype=float)
    places = np.array([each["position"] for each in waypoints], dtype=float)
    clipped = np.clip(times, moments[0], moments[-1])
    if interpolation == "smooth" and len(moments) > 1:
        return np.asarray(CubicSpline(moments, places, bc_type="clamped")(clipped))
    return np.column_stack([np.interp(clipped, moments, column) for column in places.T])
