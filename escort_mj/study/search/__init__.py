"""Searches over runs: tuning, falsification."""
