"""The base of every table of a rig file."""

from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

MOST = 1e9
"""Largest amount of any number of a rig: squares and products of such numbers are finite still."""
LEAST = 1e-9
Positive = Annotated[float, Field(gt=0, le=MOST)]
NonNegative = Annotated[float, Field(ge=0, le=MOST)]
Sigma = Annotated[float, Field(ge=LEAST, le=10.0)]
"""A standard deviation in m, rad or m/s^2: beyond these bounds it is a mistake, and ends in overflows."""
Delay = Annotated[float, Field(ge=0, le=10.0)]
"""A delay or its standard deviation, in s."""


class Section(BaseModel):
    """A table of the rig file: unknown keys, infinities, NaN and numbers beyond ``MOST`` are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, arbitrary_types_allowed=True)

    @model_validator(mode="after")
    def _is_moderate(self) -> Self:
        for key in type(self).model_fields:
            value = getattr(self, key)
            if isinstance(value, float) and abs(value) > MOST:
                raise ValueError(f"'{key}' is {value:g}: expected at most {MOST:g}")
        return self
