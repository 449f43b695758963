"""The page of a report: one HTML file that asks for nothing else."""

from collections.abc import Callable
from html import escape
from importlib import resources

from groundstation.watch.page import tables
from groundstation.watch.page.courses import (
    draw_errors,
    draw_estimate,
    draw_fixes,
    draw_happenings,
    draw_valves,
)
from groundstation.watch.page.latency import draw_latency
from groundstation.watch.page.plan import draw_plan
from groundstation.watch.page.subject import Subject

Progress = Callable[[str, float], None]
TEXTS = {
    "plan": "Trails by truth where there is any, else by the estimate. Ticks show headings; dashed outlines: "
    "start, solid: end; +: the last setpoint; numbers: events of the table below.",
    "happened": "Modes of each vehicle. Red: failures injected; amber: faults found; blue: requests; grey: "
    "the rest. The same marks stand on every time axis below.",
    "errors": "From the setpoint that the controller itself worked for, by truth where there is any, from "
    "the first flight on; logarithmic.",
    "estimate": "Line: estimate minus truth. Area: three sigma that the filter states, as wide as it was at "
    "most in each column.",
    "valves": "As the guard let them: a bar's height is the share of its column of time that the valve was "
    "open. Gas: nominal thrust times open time of all valves, without delays.",
    "fixes": "Innovations of used fixes (dots; where they are many, from the least to the largest) and of "
    "those not used (crosses, on the edge where they lie beyond it or were never compared); dotted: the mean "
    "NIS to be expected.",
    "latency": "Age of the light at each stage since the middle of its exposure, and from the arrival of "
    "bytes to the state, at the end of the run. Bar: median; line: up to the 99th percentile.",
}
"""What stands below or above the pictures."""


def render_page(subject: Subject, progress: Progress) -> str:
    """The whole file as text.

    Args:
        subject: What it is about.
        progress: Takes what is being drawn, and the share that is done.
    """
    style = resources.files(__package__).joinpath("page.css").read_text(encoding="utf-8")
    sections = _sections(subject)
    body = [_head(subject)]
    for done, (title, make) in enumerate(sections, start=1):
        progress(f"drawing {title.lower()}", done / (len(sections) + 1))
        content = make()
        if content:
            body.append(f"<section>\n<h2>{escape(title)}</h2>\n{content}</section>\n")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8"/>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1"/>\n'
        f"<title>{escape(title_of(subject))}</title>\n<style>\n{style}</style>\n</head>\n"
        f"<body>\n{''.join(body)}</body>\n</html>\n"
    )


def title_of(subject: Subject) -> str:
    """What stands above the page."""
    verdict = subject.verdict
    return (verdict.title if verdict is not None else "") or f"Report of {subject.run.name}"


def _head(subject: Subject) -> str:
    run, verdict = subject.run, subject.verdict
    facts = [f"{run.duration_s:.1f} s recorded", ", ".join(run.vehicles), run.rig.name]
    if run.info.seed is not None:
        facts.append(f"seed {run.info.seed}")
    out = [f"<header>\n<h1>{escape(title_of(subject))}</h1>\n"]
    if verdict is not None:
        badge = f'<span class="verdict {escape(verdict.verdict)}">{escape(verdict.verdict)}</span>'
        out.append(f"<p>{badge} {escape(verdict.reason)}</p>\n")
        if verdict.limits:
            out.append(_wide(tables.limits(verdict)))
    out.append(_note(f"{'; '.join(fact for fact in facts if fact)}. t = 0 is when {subject.zero_words}."))
    if subject.other is not None:
        out.append(_note(f"Compared with {subject.other.name}: dashed and paler."))
    return "".join(out) + "</header>\n"


def _sections(subject: Subject) -> list[tuple[str, Callable[[], str]]]:
    """Title of each section, and what makes its content."""
    return [
        ("On the table", lambda: draw_plan(subject) + _note(TEXTS["plan"])),
        (
            "What happened",
            lambda: draw_happenings(subject) + _note(TEXTS["happened"]) + _wide(tables.events(subject)),
        ),
        ("Numbers", lambda: _wide(tables.numbers(subject))),
        ("Off the setpoint", lambda: draw_errors(subject) + _note(TEXTS["errors"])),
        ("Estimate minus truth", lambda: _note(TEXTS["estimate"]) + _each(subject, draw_estimate)),
        ("Valves and gas", lambda: _note(TEXTS["valves"]) + _each(subject, draw_valves)),
        ("Fixes", lambda: _wide(tables.fixes(subject)) + draw_fixes(subject) + _note(TEXTS["fixes"])),
        (
            "Latency",
            lambda: draw_latency(subject) + _note(TEXTS["latency"]) + _wide(tables.latency(subject)),
        ),
        (
            "Made with",
            lambda: "".join(
                _wide(tables.provenance(run)) for run in (subject.run, subject.other) if run is not None
            ),
        ),
    ]


def _each(subject: Subject, draw: Callable[[Subject, str], str]) -> str:
    """A picture of each vehicle."""
    return "".join(f"<h3>{escape(name)}</h3>\n{draw(subject, name)}" for name in subject.names)


def _note(words: str) -> str:
    return f'<p class="faint">{escape(words)}</p>\n'


def _wide(content: str) -> str:
    return f'<div class="wide">{content}</div>\n' if content else ""
