"""What all parameter tables share: typed, bounded, frozen, no unknown keys, no NaN or infinity."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

UNLIMITED = 1e300  # stands for an infinite limit, which XML cannot hold
TEXT = r"^[^\x00-\x08\x0b-\x1f\x7f-\x9f\ufffe\uffff]*$"  # what NetCDF and XML can hold

Radius = Annotated[float, Field(ge=1e-3, le=1e5)]
Force = Annotated[float, Field(ge=1e-15, le=1e12)]
Mass = Annotated[float, Field(ge=1e-6, le=1e9)]


class Parameters(BaseModel):
    """Base of every table of parameters that a scenario can set."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True, strict=False
    )
