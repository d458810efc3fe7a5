"""Whether a plugin is what it should be: what `escort-mj check-plugin` asks of its members."""

from escort_mj.conformance.checking import Check, check_plugin

__all__ = ["Check", "check_plugin"]
