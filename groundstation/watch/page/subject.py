"""What a page is about: one run, or two that are laid over each other, on one time axis."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from groundstation.watch.flown_run import FlownRun
from groundstation.watch.run_events import Mark
from groundstation.watch.tracks import Array, Track
from groundstation.watch.verdict import Verdict

TONES = 6
"""Colours of vehicles that the style has."""


class Drawn(NamedTuple):
    """A vehicle of one of the runs.

    Attributes:
        name: Of the vehicle.
        track: What is drawn.
        kind: Class of its colour.
        words: For a legend.
        zero_s: To be subtracted from the times of the track.
        run: Which it is of.
    """

    name: str
    track: Track
    kind: str
    words: str
    zero_s: float
    run: FlownRun

    def t(self, rows: Array) -> Array:
        """Times of rows on the page's axis."""
        found: Array = rows[:, 0] - self.zero_s
        return found


@dataclass(frozen=True, slots=True)
class Subject:
    """What is drawn.

    Attributes:
        run: The run.
        zero_s: Where its axis begins to count, s since its recording began.
        zero_words: What happens at t = 0, behind "is when".
        marks: Of the run, in order; numbered from 1.
        verdict: On the run, if there is one.
        other: A run to compare with.
        other_zero_s: Where the other one's axis begins to count.
    """

    run: FlownRun
    zero_s: float
    zero_words: str
    marks: list[Mark]
    verdict: Verdict | None = None
    other: FlownRun | None = None
    other_zero_s: float = 0.0

    @property
    def names(self) -> list[str]:
        """Vehicles of both runs."""
        others = self.other.vehicles if self.other is not None else {}
        return list(dict.fromkeys([*self.run.vehicles, *others]))

    @property
    def span(self) -> tuple[float, float]:
        """Both ends of every time axis."""
        start, stop = -self.zero_s, self.run.duration_s - self.zero_s
        if self.other is not None:
            start = min(start, -self.other_zero_s)
            stop = max(stop, self.other.duration_s - self.other_zero_s)
        return start, max(stop, start + 1e-3)

    def kind(self, name: str) -> str:
        """Class of a vehicle's colour."""
        return f"v{self.names.index(name) % TONES}"

    def drawn(self, name: str | None = None) -> Iterator[Drawn]:
        """A vehicle of both runs, the other one first, so that it lies below; all vehicles without a name."""
        names = self.names if name is None else [name]
        for run, zero_s, tone in ((self.other, self.other_zero_s, " other"), (self.run, self.zero_s, "")):
            for each in names:
                if run is not None and each in run.vehicles:
                    words = each if self.other is None else f"{each}, {run.name}"
                    track = run.vehicles[each].track
                    yield Drawn(each, track, self.kind(each) + tone, words, zero_s, run)

    def numbered(self, name: str | None = None) -> list[tuple[int, Mark]]:
        """Marks on the page's axis with their numbers; of one vehicle also those that befell all."""
        return [
            (index, Mark(mark.t_s - self.zero_s, _less(mark.until_s, self.zero_s), *_rest(mark)))
            for index, mark in enumerate(self.marks, start=1)
            if name is None or mark.vehicle in ("", name)
        ]


def _less(until_s: float | None, zero_s: float) -> float | None:
    return None if until_s is None else until_s - zero_s


def _rest(mark: Mark) -> tuple[str, str, str]:
    return mark.kind, mark.vehicle, mark.text
