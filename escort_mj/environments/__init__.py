"""Scenarios for learned policies: the same worlds, sensors and native step, commanded from outside.

`Simulation` needs nothing beyond the core; `parallel_env` and `EscortEnv` need the extra `rl` (PettingZoo and
Gymnasium); `dm_environment` needs dm_env, which comes with dm_control.
"""

from escort_mj.environments.simulation import Reward, Simulation

__all__ = ["Reward", "Simulation"]
