"""Policies, one file each: the will of targets and opponents. Any file that has one is found."""

from escort_mj.components.found import found_in
from escort_mj.policies.body import Body
from escort_mj.policies.policy import ACTS, RESTS, Policy

POLICIES: tuple[type[Policy], ...] = found_in(__name__, __path__, Policy)

__all__ = ["ACTS", "POLICIES", "RESTS", "Body", "Policy"]
