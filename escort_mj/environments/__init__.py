"""Scenarios for learned policies: the same worlds, sensors and native step, commanded from outside.

`Simulation` needs nothing beyond the core; `parallel`, `single`, `vector` and `dm` need the extra `rl`
(PettingZoo, Gymnasium and dm_env); `dataset` needs the extra `minari`. Where Gymnasium is installed,
importing this package registers `escort_mj/Escort-v0` with it.
"""

from escort_mj.environments.registration import register
from escort_mj.environments.senses import Reward
from escort_mj.environments.simulation import Simulation

__all__ = ["Reward", "Simulation"]

register()
