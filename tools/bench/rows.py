"""A row of the benchmark table, and what a measuring function is given."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
RIGS = ROOT / "examples" / "rigs"


@dataclass(frozen=True, slots=True)
class Row:
    """One row.

    Attributes:
        what: What is measured.
        limit: As people read it; empty for a figure without a limit.
        measured: With its unit.
        ok: Whether the limit is kept; None where there is none.
    """

    what: str
    limit: str
    measured: str
    ok: bool | None

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """As printed."""
        return self.what, self.limit, self.measured, {True: "yes", False: "NO", None: ""}[self.ok]


@dataclass(frozen=True, slots=True)
class Bench:
    """What a measuring function is given.

    Attributes:
        folder: Where it may write; gone afterwards.
        live_minutes: Length of the live run.
        seeds: How many seeds where figures depend on luck.
        frames: How many star pictures of each kind.
        trials: How many pictures of each number of random lights.
        data: Folder with a data set and its truth, where one was named.
        before: Checkout of an earlier commit to stand beside, where one was named.
        unit_s: CPU seconds of the reference unit on this machine, in this run.
        say: Takes one line about what is going on.
    """

    folder: Path
    live_minutes: float
    seeds: int
    frames: int
    trials: int
    data: Path | None
    before: Path | None
    unit_s: float
    say: Callable[[str], None]

    def in_units(self, seconds: float) -> str:
        """A CPU time as a multiple of the reference unit, for comparison between machines."""
        return f"{seconds / self.unit_s:.3g} units"

    def circumstances(self) -> str:
        """The unit and the options, for the head of a table."""
        return (
            f"unit {1e3 * self.unit_s:.1f} ms of CPU; {self.live_minutes:g} min live, {self.seeds} seeds, "
            f"{self.frames} pictures of a kind, {self.trials} of random lights"
        )


Measure = Callable[[Bench], list[Row]]


class CpuTime:
    """Process CPU time of a ``with`` block, in ``seconds``."""

    seconds = 0.0

    def __enter__(self) -> "CpuTime":
        self._begin_s = time.process_time()
        return self

    def __exit__(self, *_: object) -> None:
        self.seconds = time.process_time() - self._begin_s
