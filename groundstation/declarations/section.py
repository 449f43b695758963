"""The base of every table of a rig file."""

from typing import Annotated, Self

from pydantic import AfterValidator, ConfigDict, Field, model_validator

from groundstation.declarations.calls import shortened
from groundstation.files.amounts import UNITLESS, check_amounts
from groundstation.files.plain_model import PlainModel

LEAST = 1e-9
Positive = Annotated[float, Field(gt=0, le=UNITLESS)]
NonNegative = Annotated[float, Field(ge=0, le=UNITLESS)]
Sigma = Annotated[float, Field(ge=LEAST, le=10.0)]
"""A standard deviation in m, rad or m/s^2: beyond these bounds it is a mistake, and ends in overflows."""
Delay = Annotated[float, Field(ge=0, le=10.0)]
"""A delay or its standard deviation, in s."""


def _is_plain(text: str) -> str:
    """Refuse what would move a terminal's cursor or break a report."""
    if not text.strip() or not text.isprintable():
        raise ValueError(f"expected words on one line, without control characters, found {shortened(text)!r}")
    return text


Words = Annotated[str, Field(max_length=200), AfterValidator(_is_plain)]
"""What stands in terminals, recordings and reports."""


class Section(PlainModel):
    """A table of the rig file: unknown keys, infinities, NaN and what its unit cannot mean are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, arbitrary_types_allowed=True)

    @model_validator(mode="after")
    def _is_moderate(self) -> Self:
        check_amounts({key: getattr(self, key) for key in type(self).model_fields})
        return self
