"""What a published study is: sources of data, figures drawn from them, numbers beside published ones.

A package adds a study by an entry point of the group ``groundstation.studies`` that names a `Study`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

Progress = Callable[[str, float], None]
"""Takes what is going on and the share that is done."""
PUBLISHED, DEFAULT = "published", "default"
"""The two sides of every figure: the published methods, and ours, under the same condition."""


class Source(Protocol):
    """Where data of a study come from: flights in a closed loop, or whatever a function makes."""

    @property
    def size(self) -> float:
        """How much work it is beside the others, for the progress that is shown."""
        ...

    def make(self, name: str, folder: Path, progress: Progress, /) -> Any:  # noqa: ANN401 - figures know what
        """Make the data.

        Args:
            name: Of the source in its study.
            folder: Of the study's report; what is worth keeping is left there.
            progress: Takes what is going on and the share of this source that is done.
        """
        ...


@dataclass(frozen=True, slots=True)
class Generated:
    """Data that a function makes, all sides at once.

    Attributes:
        function: Takes the progress.
        size: Beside other sources.
    """

    function: Callable[[Progress], Any]
    size: float = 1.0

    def make(self, name: str, folder: Path, progress: Progress) -> Any:  # noqa: ANN401 - figures know what
        """Call the function."""
        del name, folder
        return self.function(progress)


@dataclass(frozen=True, slots=True)
class Number:
    """A number of a figure beside the published one.

    Attributes:
        quantity: What, with its unit.
        published: As published; NaN where nothing is stated.
        ours: By the published methods on emulated data; NaN where it has no meaning.
        default: By our defaults under the same condition.
        assumed: What had to be assumed, or what the published number is.
        ratio: Ours may differ by this factor, up or down, and still comes out; None: it is not compared.
        is_put_in: The condition was chosen to have this number: that it is there proves nothing.
    """

    quantity: str
    published: float = math.nan
    ours: float = math.nan
    default: float = math.nan
    assumed: str = ""
    ratio: float | None = None
    is_put_in: bool = False

    @classmethod
    def beside(
        cls,
        quantity: str,
        published: float,
        sides: Iterable[float],
        assumed: str = "",
        ratio: float | None = None,
        *,
        is_put_in: bool = False,
    ) -> Number:
        """A number of both sides: by the published methods, and by our defaults."""
        ours, default = sides
        return cls(quantity, published, ours, default, assumed, ratio, is_put_in)

    @property
    def comes_out(self) -> bool | None:
        """Whether ours is the published number within the factor; None where they are not compared."""
        if self.ratio is None or self.is_put_in or not math.isfinite(self.published):
            return None
        if not math.isfinite(self.ours) or self.ours * self.published <= 0.0:
            return self.ours == self.published
        return 1.0 / self.ratio <= self.ours / self.published <= self.ratio


@dataclass(frozen=True, slots=True)
class Drawn:
    """What a figure became.

    Attributes:
        pictures: Caption and SVG of each picture; the first of the published methods.
        numbers: Beside the published ones.
        words: What is seen.
    """

    pictures: Sequence[tuple[str, str]]
    numbers: Sequence[Number]
    words: str


Draw = Callable[[Mapping[str, Any]], Drawn]
"""Draws a figure from what the sources that it needs have made, by name."""


@dataclass(frozen=True, slots=True)
class FigureRow:
    """A figure or table of a study.

    Attributes:
        numbers: Of the published figures that it redraws: 8, or as text where they are ``2.12``.
        title: What they show.
        published: What the publication shows and states there.
        needs: Names of the sources that it needs.
        draw: Draws it.
        assumed: What is not published and had to be assumed, in sentences.
        kind: ``figure`` or ``table``.
    """

    numbers: tuple[int | str, ...]
    title: str
    published: str
    needs: tuple[str, ...]
    draw: Draw
    assumed: tuple[str, ...] = ()
    kind: str = "figure"

    @property
    def label(self) -> str:
        """As people call it: ``Figures 8, 9``."""
        many = "s" if len(self.numbers) > 1 else ""
        return f"{self.kind.capitalize()}{many} {', '.join(map(str, self.numbers))}"


@dataclass(frozen=True, slots=True)
class Study:
    """A publication that can be run again.

    Attributes:
        name: On the command line.
        title: Of the publication, in English.
        source: Who and where.
        sources: Of its data, by name.
        figures: In order.
        not_drawn: Figures that hold nothing to be computed, and why, by their numbers in words.
        about: How its two sides were made, for the head of the report.
    """

    name: str
    title: str
    source: str
    sources: Mapping[str, Source]
    figures: Sequence[FigureRow]
    not_drawn: Mapping[str, str] = field(default_factory=dict)
    about: str = "Both sides were given the same data."
