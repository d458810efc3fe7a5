"""Measurements of speed, as ratios to something timed beside it in the same process."""
