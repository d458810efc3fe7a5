"""From YAML text to a checked scenario and back, with the place of every fault."""
