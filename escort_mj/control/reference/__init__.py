"""The law once more, in plain NumPy and straight from the paper: the twin of the compiled kernels.

Here the team is one vector of p n coordinates. A behavior is a task with the paper's block-diagonal
Jacobian J, shape (n, p n); its velocity is J^+ Lambda sigma~ and its null space I - J^+ J, with
`numpy.linalg.pinv` for J^+. Nothing is simplified, so this code and the kernels share neither a line
nor a closed form. It is slow, and it is what the kernels are held against.

Unless said otherwise q, v, e are of the whole team, shape (n, p) [m], [m/s], [m], world frame.
"""

from escort_mj.control.reference.controller import ReferenceController, ReferenceSignals

__all__ = ["ReferenceController", "ReferenceSignals"]
