"""What the water does to vessels, written where MuJoCo has what its own dynamics would have there.

That is before it solves for accelerations and contact forces: both follow from vessel and water together.
"""

from __future__ import annotations

from escort_mj.monitor.mass import INT
from escort_mj.native.kernels import DOUBLE, int_at, matrix_at, pointer_at, stack_memory, vector_at
from escort_mj.native.on_demand import on_demand
from escort_mj.robots.addresses import Addresses
from escort_mj.robots.hydrodynamics import ENTRIES, FREEDOMS, immerse
from escort_mj.world.loop.layout import offset
from escort_mj.world.loop.library import factor_mass

MODEL_ROW_STARTS = offset("mjModel", "M_rowadr")
DATA_QPOS, DATA_QVEL = offset("mjData", "qpos"), offset("mjData", "qvel")
DATA_MASS, DATA_BIAS = offset("mjData", "M"), offset("mjData", "qfrc_bias")
DATA_PASSIVE = offset("mjData", "qfrc_passive")


@on_demand
def float_vessels(m: int, d: int, addresses: Addresses) -> None:
    """Completes the mass matrix, bias force and passive force of all vessels.

    Args:
        m: Address of MuJoCo's model.
        d: Address of its data, with positions and velocities worked out.
        addresses: Gives the vessels.
    """
    scratch = matrix_at(stack_memory(), 2, FREEDOMS)
    coriolis, damping = scratch[0], scratch[1]
    for row in range(addresses.vessels.shape[0]):
        i = int(addresses.vessel_robot[row])
        first = int(addresses.dof_address[i])
        heading = vector_at(pointer_at(d + DATA_QPOS()) + DOUBLE * int(addresses.qpos_address[i]), FREEDOMS)[
            2
        ]
        velocity = vector_at(pointer_at(d + DATA_QVEL()) + DOUBLE * first, FREEDOMS)
        # A vessel is a tree of its own: the entries of its rows stand in a row.
        entry = int_at(pointer_at(m + MODEL_ROW_STARTS()) + INT * first)
        mass = vector_at(pointer_at(d + DATA_MASS()) + DOUBLE * entry, ENTRIES)
        immerse(heading, velocity, addresses.vessels[row], mass, coriolis, damping)
        bias = vector_at(pointer_at(d + DATA_BIAS()) + DOUBLE * first, FREEDOMS)
        passive = vector_at(pointer_at(d + DATA_PASSIVE()) + DOUBLE * first, FREEDOMS)
        for k in range(FREEDOMS):
            bias[k] += coriolis[k]
            passive[k] += damping[k]
    factor_mass(m, d)
