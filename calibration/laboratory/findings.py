"""What a flight shows of a laboratory, what it did not, and what was taken as true."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Found:
    """One number with its sigma.

    Attributes:
        value: In the unit.
        sigma: One standard deviation, given what is assumed.
        unit: As words.
        remark: What else a person should know; may be empty.
    """

    value: float
    sigma: float
    unit: str
    remark: str = ""


@dataclass(frozen=True, slots=True)
class Findings:
    """Of a table or of a vehicle, by the keys of the emulated laboratory where there are such keys.

    Attributes:
        found: What is known now.
        unseen: What is not, with the reason.
        assumed: What was taken as true, a sentence each.
    """

    found: Mapping[str, Found] = field(default_factory=dict)
    unseen: Mapping[str, str] = field(default_factory=dict)
    assumed: tuple[str, ...] = ()

    def __add__(self, other: Findings) -> Findings:
        """Both together."""
        return Findings(
            {**self.found, **other.found}, {**self.unseen, **other.unseen}, self.assumed + other.assumed
        )


def sentence(key: str, found: Found) -> str:
    """Return a number in words."""
    remark = f" ({found.remark})" if found.remark else ""
    return f"{key} = {found.value:.6g} ± {found.sigma:.2g} {found.unit}{remark}"
