"""Elements of SVG as text. Colours are classes: the page's style has them for light, dark and print."""

from collections.abc import Iterable
from html import escape

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def number(value: float) -> str:
    """To a tenth of a pixel, as short as can be."""
    return f"{value:.1f}".removesuffix(".0")


def text(x: float, y: float, words: str, kind: str = "", anchor: str = "start", turn: float = 0.0) -> str:
    """A line of text; turned by so many degrees about its place."""
    turned = f' transform="rotate({number(turn)} {number(x)} {number(y)})"' if turn else ""
    named = f' class="{kind}"' if kind else ""
    place = f'x="{number(x)}" y="{number(y)}"'
    anchored = "" if anchor == "start" else f' text-anchor="{anchor}"'
    return f"<text {place}{named}{anchored}{turned}>{escape(words)}</text>"


def line(x1: float, y1: float, x2: float, y2: float, kind: str) -> str:
    """A straight line."""
    return f'<path class="{kind}" d="M{number(x1)} {number(y1)}L{number(x2)} {number(y2)}"/>'


def rectangle(x: float, y: float, width: float, height: float, kind: str, title: str = "") -> str:
    """A rectangle; its title is shown where the pointer rests."""
    place = f'x="{number(x)}" y="{number(y)}" width="{number(width)}" height="{number(height)}"'
    if not title:
        return f'<rect class="{kind}" {place}/>'
    return f'<rect class="{kind}" {place}><title>{escape(title)}</title></rect>'


def circle(x: float, y: float, radius: float, kind: str) -> str:
    """A circle."""
    return f'<circle class="{kind}" cx="{number(x)}" cy="{number(y)}" r="{number(radius)}"/>'


def way(x: Array, y: Array) -> str:
    """Path data through points; broken where one of them is NaN."""
    out: list[str] = []
    is_open = False
    for here, there in zip(np.round(x, 1).tolist(), np.round(y, 1).tolist(), strict=True):
        if here != here or there != there:
            is_open = False
            continue
        out.append(f"{'L' if is_open else 'M'}{here:g} {there:g}")
        is_open = True
    return "".join(out)


def path(data: str, kind: str) -> str:
    """A path; nothing for one without points."""
    return f'<path class="{kind}" d="{data}"/>' if data else ""


def group(parts: Iterable[str], kind: str) -> str:
    """Elements under one class."""
    return f'<g class="{kind}">{"".join(parts)}</g>'


def picture(parts: Iterable[str], width: float, height: float, label: str) -> str:
    """A whole picture; it takes the width that the page gives it."""
    box = f'viewBox="0 0 {number(width)} {number(height)}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {box} role="img" aria-label="{escape(label)}">'
    return f"{head}{''.join(parts)}</svg>\n"
