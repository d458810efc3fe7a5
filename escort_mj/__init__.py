"""escort_mj: multi-robot escort missions on real physics."""
