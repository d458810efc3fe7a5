"""Functions of NumPy in equations: what they are of eight numbers at once."""

from typing import Any

import numpy as np

from escort_mj.native.lanes import copysign, everywhere, root, where
from escort_mj.native.values import numpy_forms
from escort_mj.numerics.elementary import exponential, logarithm, power, sine_and_cosine, tanh

numpy_forms += [
    (np.tanh, 1, lambda x: tanh(x)),
    (np.sqrt, 1, lambda x: root(x)),
    (np.abs, 1, lambda x: abs(x)),
    (np.fabs, 1, lambda x: abs(x)),
    (np.square, 1, lambda x: x * x),
    (np.sin, 1, lambda x: sine_and_cosine(x)[0]),
    (np.cos, 1, lambda x: sine_and_cosine(x)[1]),
    (np.log, 1, lambda x: logarithm(x)),
    (np.exp, 1, lambda x: exponential(x)),
    (np.power, 2, lambda x, y: power(everywhere(x), everywhere(y))),
    (np.sign, 1, lambda x: where(x > 0.0, 1.0, where(x < 0.0, -1.0, x))),
    (np.copysign, 2, lambda x, y: copysign(everywhere(x), everywhere(y))),
    (np.where, 3, lambda x, y, z: where(x, y, z)),
]


def _minimum(x: Any, y: Any) -> Any:
    a, b = everywhere(x), everywhere(y)
    return where(a != a, a, where(a < b, a, b))


def _maximum(x: Any, y: Any) -> Any:
    a, b = everywhere(x), everywhere(y)
    return where(a != a, a, where(a > b, a, b))


def _clip(x: Any, low: Any, high: Any) -> Any:
    return np.minimum(np.maximum(x, low), everywhere(high))


numpy_forms += [(np.minimum, 2, _minimum), (np.maximum, 2, _maximum), (np.clip, 3, _clip)]
