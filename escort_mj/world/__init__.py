"""The only floor that knows MuJoCo: building worlds, stepping them, and watching what happens in them."""

from escort_mj import gl

gl.make_import_safe()  # simulation needs no GL, and with a missing one even `import mujoco` can fail
