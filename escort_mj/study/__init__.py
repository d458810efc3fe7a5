"""Many runs: what they are, side by side on all cores, and what they say together."""
