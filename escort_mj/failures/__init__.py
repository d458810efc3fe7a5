"""Failures of motors: what motors that fail still do. Any file that has one is found."""

from escort_mj.components.found import found_in
from escort_mj.failures.failure import Failure
from escort_mj.failures.motors import Dead

FAILURES: tuple[type[Failure], ...] = found_in(__name__, __path__, Failure)

__all__ = ["FAILURES", "Dead", "Failure"]
