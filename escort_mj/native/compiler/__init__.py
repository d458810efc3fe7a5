"""Turns kernels into machine code: the only part that imports numba, mostly in a process of its own.

`declarations` teaches numba what `kernels`, `memory`, `lanes` and `on_demand` only name; `views`, `lanes` and
`machine` say by which instructions; `pieces` compiles what is kept on disk.
"""

EVERY_KERNEL = (
    "escort_mj.world.loop.step",
    "escort_mj.memory.evaluation",
    "escort_mj.memory.perception",
    "escort_mj.memory.rivals",
)
"""Modules that bring all kernels and views."""
EVERY_TEXT = ("escort_mj.world.loop.layout", "escort_mj.world.model.parts")
"""Modules with texts that take long to make: each has a function `texts` that returns them by name."""
