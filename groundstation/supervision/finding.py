"""What a consistency check found, in words."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that does not fit.

    Attributes:
        id: Of the fault in the fault table.
        detail: Which part, how much, and what it cannot be told apart from.
        whose: What it befalls, where the fault does not say it; two findings of one valve agree in it.
    """

    id: str
    detail: str
    whose: str = ""
