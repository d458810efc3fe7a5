"""The assignment of largest total: small ones without importing `scipy.optimize`, which takes 0.5 s."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SMALL = 12  # rows up to which plain Python takes less time than the import


def best_assignment(values: Array) -> NDArray[np.int64]:
    """Return the column of each row so that the sum of the values is largest, each column once.

    Shortest augmenting paths (Crouse 2016), with the same order of operations as SciPy's
    `linear_sum_assignment`: the same assignment, also where several are best.

    Args:
        values: Finite values, shape (n, n).
    """
    n = len(values)
    if n > SMALL:
        from scipy.optimize import linear_sum_assignment

        return np.asarray(linear_sum_assignment(values, maximize=True)[1])
    costs = (-values).tolist()
    row_prices, column_prices = [0.0] * n, [0.0] * n
    row_of, column_of = [-1] * n, [-1] * n
    for first in range(n):
        least, before = [math.inf] * n, [-1] * n
        left = list(range(n - 1, -1, -1))
        rows, columns = [], []
        row, total = first, 0.0
        while True:
            rows.append(row)
            cost, price = costs[row], row_prices[row]
            lowest, at = math.inf, -1
            for place, column in enumerate(left):
                reached = total + cost[column] - price - column_prices[column]
                if reached < least[column]:
                    before[column], least[column] = row, reached
                if least[column] < lowest or (least[column] == lowest and row_of[column] < 0):
                    lowest, at = least[column], place
            total, column = lowest, left[at]
            columns.append(column)
            if row_of[column] < 0:
                break
            row = row_of[column]
            left[at] = left[-1]
            left.pop()
        row_prices[first] += total
        for row in rows[1:]:
            row_prices[row] += total - least[column_of[row]]
        for each in columns:
            column_prices[each] -= total - least[each]
        while column >= 0:
            row = row_of[column] = before[column]
            column_of[row], column = column, column_of[row]
    return np.array(column_of, dtype=np.int64)
