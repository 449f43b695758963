"""Numbers that several commands take, each declared once with what can be meant by it."""

from typing import Annotated

import typer

LONGEST_S = 31_557_600.0
"""A Julian year: no recording is longer."""
LAST_SEED = 2**63 - 1
"""What tables of runs keep as a whole number."""
MOST_MESSAGES = 2**32 - 1
"""Of one topic: recordings number them with 32 bits."""

FromS = Annotated[
    float, typer.Option("--from-s", help="From here, s since the recording began.", min=0.0, max=LONGEST_S)
]
ToS = Annotated[
    float | None, typer.Option("--to-s", help="To here; default: the end.", min=0.0, max=LONGEST_S)
]
