"""What kernels are given (`Plan`) and what they write (`State`), as their annotations name them.

`memory.layout` composes both of what components declare. Type checkers read all fields in `plan.pyi`, which
`python -m escort_mj.memory.stub` writes.
"""

from escort_mj.native.fields import Fields


class Plan(Fields):
    """What the compiled controller is given; SI units, world frame."""


class State(Fields):
    """What the compiled controller writes: first what is recorded, last the samples that it keeps."""
