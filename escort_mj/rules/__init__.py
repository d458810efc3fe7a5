"""Rules of the supervisor: what conditions for phases compare. Any file that has one is found."""

from escort_mj.components.found import found_in
from escort_mj.rules.rule import Rule

RULES: tuple[type[Rule], ...] = found_in(__name__, __path__, Rule)

__all__ = ["RULES", "Rule"]
