"""What all tables of the scenario share."""

from typing import Annotated, Self

from pydantic import ConfigDict, Field, model_validator

from drivers.files.amounts import check_amounts
from drivers.files.plain_model import PlainModel

_UNBOUNDED = ("seed", "seed_offset", "end_s")  # numbers without a size, and what may last for ever

Pair = tuple[float, float]
Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]


class Settings(PlainModel):
    """What all tables share: unknown keys are errors, values do not change after reading."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @model_validator(mode="after")
    def _is_moderate(self) -> Self:
        check_amounts({key: getattr(self, key) for key in type(self).model_fields if key not in _UNBOUNDED})
        return self
