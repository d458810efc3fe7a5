"""Watching a run: in a browser by viser, or in MuJoCo's own viewer; live or recorded."""
