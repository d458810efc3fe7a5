"""What all parameter tables share: typed, bounded, frozen, no unknown keys, no NaN or infinity."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

UNLIMITED = 1e300  # stands for an infinite limit, which XML cannot hold


class Parameters(BaseModel):
    """Base of every table of parameters that a scenario can set."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True, strict=False
    )
