"""Missions in which who looks at samples, at centers or at MuJoCo's list alone is wrong: ten of a kind."""

from tests.independent.inside import INSIDE
from tests.independent.missions import Keys, Variation
from tests.independent.speed import SPEED
from tests.independent.through import THROUGH
from tests.independent.time import TIME

__all__ = ["EVERY", "GROUPS", "Keys", "Variation"]

GROUPS = {"time": TIME, "through": THROUGH, "inside": INSIDE, "speed": SPEED}
EVERY = [(group, variation) for group, variations in GROUPS.items() for variation in variations]
