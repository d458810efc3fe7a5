"""A counterexample made as small as it goes: as few keys as possible, as near to the base as possible."""

from __future__ import annotations

from collections.abc import Callable, Mapping

HALVINGS = 7
DIGITS = 3

Point = Mapping[str, float | int]


def shrink(
    point: Point, base: Mapping[str, float | None], fails: Callable[[Point], bool]
) -> dict[str, float]:
    """Shrinks a point that fails, and keeps it failing.

    First every key that is not needed goes back to its base; then, key by key, bisection moves what is left
    as near to its base as it goes; then numbers lose the digits that they do not need.

    Args:
        point: Keys and numbers with which it fails.
        base: The number that each key has without the search; None for what is no number there.
        fails: Whether a point fails; keys that it leaves out are at their base.
    """
    small = dict(point)
    for key in sorted(small, key=lambda key: _distance(small[key], base[key])):
        without = {name: value for name, value in small.items() if name != key}
        if fails(without):
            small = without
    for key, origin in base.items():
        if key in small and origin is not None:
            small[key] = _nearest(small, key, origin, fails)
    for key in small:
        shorter = small | {key: _rounded(small[key])}
        if shorter != small and fails(shorter):
            small = shorter
    return small


def _distance(value: float, origin: float | None) -> float:
    """How far a number is from its base, relative to both."""
    return 1.0 if origin is None else abs(value - origin) / (abs(value) + abs(origin) or 1.0)


def _nearest(point: Point, key: str, origin: float, fails: Callable[[Point], bool]) -> float | int:
    """The number nearest to a key's base with which it still fails, by bisection."""
    failing, passing = point[key], origin
    for _ in range(HALVINGS):
        middle = 0.5 * (failing + passing)
        if isinstance(point[key], int):
            middle = round(middle)
        if middle in (failing, passing):
            break
        if fails({**point, key: middle}):
            failing = middle
        else:
            passing = middle
    return failing


def _rounded(value: float | int) -> float | int:
    return value if isinstance(value, int) else float(f"{value:.{DIGITS}g}")
