"""The base of every table of a rig file."""

from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from groundstation.files.amounts import UNITLESS, check_amounts

LEAST = 1e-9
Positive = Annotated[float, Field(gt=0, le=UNITLESS)]
NonNegative = Annotated[float, Field(ge=0, le=UNITLESS)]
Sigma = Annotated[float, Field(ge=LEAST, le=10.0)]
"""A standard deviation in m, rad or m/s^2: beyond these bounds it is a mistake, and ends in overflows."""
Delay = Annotated[float, Field(ge=0, le=10.0)]
"""A delay or its standard deviation, in s."""


class Section(BaseModel):
    """A table of the rig file: unknown keys, infinities, NaN and what its unit cannot mean are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, arbitrary_types_allowed=True)

    @model_validator(mode="after")
    def _is_moderate(self) -> Self:
        check_amounts({key: getattr(self, key) for key in type(self).model_fields})
        return self
