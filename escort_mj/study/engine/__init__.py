"""Many runs side by side, and the store of their results."""
