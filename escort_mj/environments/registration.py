"""The environment's name for `gymnasium.make`."""

from __future__ import annotations

ENVIRONMENT = "escort_mj/Escort-v0"


def register() -> None:
    """Register the environment and its native vector form, if Gymnasium is installed."""
    try:
        from gymnasium.envs import registration
    except ImportError:
        return
    if ENVIRONMENT not in registration.registry:
        registration.register(
            ENVIRONMENT,
            entry_point="escort_mj.environments.single:EscortEnv",
            vector_entry_point="escort_mj.environments.vector:EscortVectorEnv",
        )
