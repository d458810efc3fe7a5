"""Videos of runs, and clips around the worst moment."""
