"""Runs for other programs: Foxglove, MuJoCo's own states."""
