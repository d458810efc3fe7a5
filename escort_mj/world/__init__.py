"""The only floor that knows MuJoCo: building worlds, stepping them, and watching what happens in them."""

import os

# Simulation needs no GL; with a missing one even `import mujoco` can fail. Rendering has its own process.
os.environ.setdefault("MUJOCO_GL", "disable")
