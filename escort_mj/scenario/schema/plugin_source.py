"""Where a scenario's plugins are."""

from typing import Annotated

from pydantic import Field

from escort_mj.components.parameters import Parameters


class PluginSource(Parameters):
    """Location of a plugin: a Python file or an installed package."""

    file: Annotated[str, Field(min_length=4, pattern=r"\.py$")] | None = None
    """Path of a Python file, relative to the scenario's folder."""
    package: Annotated[str, Field(min_length=1, max_length=100)] | None = None
    """Name of an entry point in the group escort_mj.plugins of an installed package."""
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")] | None = None
    """Required SHA-256 digest of the plugin's content; null: any. Every run writes the digest into its stored
    scenario."""
