"""Logs of real robots: read, put on the mission's clock, and judged as a run is."""
