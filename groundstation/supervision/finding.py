"""What a consistency check found, in words."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that does not fit.

    Attributes:
        id: Of the fault in the fault table.
        detail: Which part, how much, and what it cannot be told apart from.
    """

    id: str
    detail: str
