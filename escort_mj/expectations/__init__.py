"""What must hold for a run to pass, a file for each kind: any file here that defines one is found."""

from escort_mj.components.found import found_in
from escort_mj.expectations.expectation import Expectation

EXPECTATIONS: tuple[type[Expectation], ...] = tuple(
    sorted(found_in(__name__, __path__, Expectation), key=lambda kind: (kind.rank, kind.kind))
)
