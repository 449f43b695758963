"""The report of a study: one HTML file that asks for nothing else."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from importlib import resources

from groundstation.recording.software import software
from groundstation.studies.study import Drawn, FigureRow, Number, Study
from groundstation.watch.page.tables import table

STYLE = """.thick.line { stroke-width: 3.2; stroke-opacity: .45; } .truth { color: var(--ink); }
.arrow { stroke: var(--edge); stroke-width: .9; fill: none; }
.injected { stroke: var(--bad); stroke-width: .8; stroke-dasharray: 2 2; }
.study td:nth-child(n+5), .study th:nth-child(n+5) { text-align: left; }
.out { color: var(--bad); font-weight: 600; } .comes { color: var(--good); font-weight: 600; }
figure { margin: .6rem 0; break-inside: avoid; } figcaption { color: var(--faint); font-size: .86rem; }
ul { margin: .3rem 0; padding-left: 1.2rem; } .toc { columns: 2; font-size: .9rem; } a { color: var(--ask); }
@media (max-width: 40rem) { .toc { columns: 1; } }
"""
ABOUT = (
    "Redrawn from data of the emulator, not from hardware. Published methods are those of the publication "
    "to the letter, our defaults ours under the same condition. A number comes out where it is the "
    "published one within the factor that its row allows; one that the condition was chosen to have is "
    "called put in, for it proves nothing."
)


def render_page(study: Study, drawn: Sequence[tuple[FigureRow, Drawn]]) -> str:
    """The whole file as text.

    Args:
        study: That was run again.
        drawn: Its figures.
    """
    style = resources.files("groundstation.watch.page").joinpath("page.css").read_text(encoding="utf-8")
    body = [_head(study, drawn), *(_figure(row, found) for row, found in drawn), _not_drawn(study)]
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8"/>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1"/>\n'
        f"<title>{escape(title_of(study))}</title>\n<style>\n{style}{STYLE}</style>\n</head>\n"
        f"<body>\n{''.join(body)}</body>\n</html>\n"
    )


def _head(study: Study, drawn: Sequence[tuple[FigureRow, Drawn]]) -> str:
    compared = [number.comes_out for _, found in drawn for number in found.numbers]
    good, bad = compared.count(True), compared.count(False)
    entries = "".join(
        f'<li><a href="#{anchor_of(row)}">{escape(row.label)}</a>: {escape(row.title)}</li>'
        for row, _ in drawn
    )
    judged = f'<span class="comes">{good} published numbers come out</span>{_does_not(bad)}; the others'
    if not good + bad:
        judged = "No published number is judged: they"
    return (
        f"<header>\n<h1>{escape(study.title)}, run again</h1>\n<p>{escape(study.source)}</p>\n"
        f"<p>{judged} are not stated, or not compared.</p>\n"
        f'<p class="faint">{escape(ABOUT)} {escape(study.about)} Made with {escape(software())}.</p>\n'
        f'<ul class="toc">{entries}</ul>\n</header>\n'
    )


def _does_not(count: int) -> str:
    if not count:
        return ""
    return f', <span class="out">{count} {"does" if count == 1 else "do"} not</span>'


def title_of(study: Study) -> str:
    """What a page is called."""
    return f"{study.name}, run again"


def anchor_of(row: FigureRow) -> str:
    """Name of a figure's section in the page."""
    return f"{row.kind}-{row.numbers[0]}"


def _figure(row: FigureRow, found: Drawn) -> str:
    pictures = "".join(
        f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>\n"
        for caption, svg in found.pictures
    )
    return (
        f'<section id="{anchor_of(row)}">\n<h2>{escape(row.label)}: {escape(row.title)}</h2>\n'
        f"<p><b>Published:</b> {escape(row.published)}</p>\n<p>{escape(found.words)}</p>\n{pictures}"
        f"{_numbers(found.numbers)}{_assumed(row.assumed)}</section>\n"
    )


def _assumed(sentences: Sequence[str]) -> str:
    if not sentences:
        return ""
    entries = "".join(f"<li>{escape(each)}</li>" for each in sentences)
    return f'<p class="faint">Assumed, since it is not published:</p>\n<ul class="faint">{entries}</ul>\n'


def _numbers(numbers: Sequence[Number]) -> str:
    if not numbers:
        return ""
    rows = [
        [
            escape(number.quantity),
            _word(number.published, "not stated"),
            _word(number.ours),
            _word(number.default),
            _verdict(number),
            escape(number.assumed),
        ]
        for number in numbers
    ]
    head = ("", "published", "published methods", "our defaults", "", "")
    return f'<div class="wide">{table(head, rows, "study")}</div>\n'


def _word(value: float, nothing: str = "\u2013") -> str:
    return f"{value:.4g}".replace("-", "\u2212") if math.isfinite(value) else nothing


def _verdict(number: Number) -> str:
    if number.is_put_in:
        return '<span class="faint">put in</span>'
    if number.comes_out is None:
        return ""
    name, words = ("comes", "comes out") if number.comes_out else ("out", "does not come out")
    return f'<span class="{name}">{words}</span> <span class="faint">within {number.ratio:g} times</span>'


def _not_drawn(study: Study) -> str:
    rows = [[escape(which), escape(why)] for which, why in study.not_drawn.items()]
    if not rows:
        return ""
    return f"<section>\n<h2>Not redrawn</h2>\n{table(('', 'why'), rows, 'provenance')}</section>\n"
