"""Measurements of speed, as ratios to something timed beside it in the same process."""

import os

os.environ.setdefault("MUJOCO_GL", "disable")  # before MuJoCo is imported
