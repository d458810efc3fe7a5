"""Expectations and their verdicts."""
