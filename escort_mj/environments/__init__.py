"""Scenarios for learned policies: the same worlds, sensors and native step, commanded from outside.

`Simulation` needs nothing beyond the core; `parallel`, `single` and `vector` need the extra `rl` (PettingZoo
and Gymnasium). Where Gymnasium is installed, importing this package registers `escort_mj/Escort-v0` with it.
"""

from escort_mj.environments.own import Now, Observation, RewardTerm
from escort_mj.environments.registration import register
from escort_mj.environments.rivals import RivalReward
from escort_mj.environments.senses import Reward
from escort_mj.environments.simulation import Simulation

__all__ = ["Now", "Observation", "Reward", "RewardTerm", "RivalReward", "Simulation"]

register()
