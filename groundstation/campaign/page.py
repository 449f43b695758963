"""The report of a campaign: one HTML file that asks for nothing else."""

import math
import shlex
from collections.abc import Sequence
from html import escape
from importlib import resources

import numpy as np

from groundstation.campaign.flying import Row
from groundstation.campaign.pictures import histogram, scatter, side_by_side
from groundstation.campaign.plan import Plan
from groundstation.campaign.statistics import (
    LimitRuns,
    drivers_of,
    errors_of,
    limits_of,
    passed_of,
    wilson,
    worst_of,
)
from groundstation.scenario.loading import Scenario
from groundstation.watch.page.tables import table

WORST, SCATTERS = 10, 12
STYLE = """.pictures { display: grid; gap: .5rem 1.5rem;
  grid-template-columns: repeat(auto-fill, minmax(22rem, 1fr)); }
.bound { stroke: var(--bad); stroke-width: 1.4; stroke-dasharray: 5 3; } .broken { color: var(--bad); }
td.left, .worst td:nth-child(n+3) { text-align: left; }
"""


def render_page(scenario: Scenario, plan: Plan, rows: Sequence[Row], software: str) -> str:
    """The whole file as text.

    Args:
        scenario: That was flown.
        plan: How often.
        rows: Of all runs.
        software: What flew it.
    """
    limits = limits_of(scenario, rows)
    style = resources.files("groundstation.watch.page").joinpath("page.css").read_text(encoding="utf-8")
    body = [
        _head(scenario, plan, rows),
        _section("Limits", _limits(limits)),
        _section(
            "Quantities",
            side_by_side(histogram(limit) for limit in limits if np.isfinite(limit.values).any()),
        ),
        _section("What drives them", _drivers(scenario, plan, rows, limits)),
        _section("The worst", _worst(scenario, plan, rows, limits)),
        _section("Errors", _errors(rows)),
        _section("Made with", _made_with(scenario, plan, software)),
    ]
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8"/>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1"/>\n'
        f"<title>{escape(scenario.name)}</title>\n<style>\n{style}{STYLE}</style>\n</head>\n"
        f"<body>\n{''.join(body)}</body>\n</html>\n"
    )


def _head(scenario: Scenario, plan: Plan, rows: Sequence[Row]) -> str:
    passed, count = passed_of(rows), len(rows)
    low, high = wilson(passed, count)
    kind = "passed" if passed == count else "failed"
    swept = f"; {plan.sweep.key} in {len(plan.sweep.values)} values" if plan.sweep else ""
    return (
        f"<header>\n<h1>{escape(scenario.name)}</h1>\n"
        f'<p><span class="verdict {kind}">{passed} of {count} passed</span> '
        f"{100 * passed / count:.1f} %; 95 % interval {100 * low:.1f} to {100 * high:.1f} %</p>\n"
        f'<p class="faint">{len(errors_of(rows))} errors; seed {plan.seed}{escape(swept)}; each run flies '
        f"{scenario.file.duration_s:g} s</p>\n</header>\n"
    )


def _section(title: str, content: str) -> str:
    return f"<section>\n<h2>{escape(title)}</h2>\n{content}</section>\n" if content else ""


def _limits(limits: Sequence[LimitRuns]) -> str:
    rows = []
    for limit in limits:
        held, count = int(limit.held.sum()), len(limit.values)
        known = limit.values[np.isfinite(limit.values)]
        shares = (
            [f"{value:.4g}" for value in np.quantile(known, (0.5, 0.95))]
            if len(known)
            else ["\u2013", "\u2013"]
        )
        kind = "good" if held == count else "bad"
        rows.append(
            [escape(limit.name), _bound(limit), f'<span class="{kind}">{held} of {count}</span>', *shares]
        )
    return table(("what", "limit", "held", "median", "95 % below"), rows) if rows else ""


def _bound(limit: LimitRuns) -> str:
    words = [
        f"{word} {bound:g}"
        for word, bound in (("below", limit.below), ("above", limit.above))
        if bound is not None
    ]
    return ", ".join(words)


def _drivers(scenario: Scenario, plan: Plan, rows: Sequence[Row], limits: Sequence[LimitRuns]) -> str:
    drivers = drivers_of(scenario, plan, rows, limits)
    if not drivers:
        return ""
    words = '<p class="faint">Each run a dot, red where the limit broke; sorted by rank correlation.</p>\n'
    return words + side_by_side(scatter(driver, rows) for driver in drivers[:SCATTERS])


def _worst(scenario: Scenario, plan: Plan, rows: Sequence[Row], limits: Sequence[LimitRuns]) -> str:
    worst = worst_of(rows, limits, WORST)
    if not worst:
        return ""
    sweep = ""
    if plan.sweep is not None:
        first, last = plan.sweep.values[0], plan.sweep.values[-1]
        sweep = f" --sweep {shlex.quote(f'{plan.sweep.key}={first!r}:{last!r}:{len(plan.sweep.values)}')}"
    asked = f"{shlex.quote(str(scenario.path))} --runs {plan.runs} --seed {plan.seed}{sweep}"
    command = f"groundstation campaign {asked} --out rerun --only"
    shown = [
        [
            row["run"],
            escape(row["verdict"]),
            escape(row["reason"]),
            f"<code>{escape(command)} {row['run']}</code>",
        ]
        for row in worst
    ]
    return table(("run", "verdict", "reason", "flies it again and records it"), shown, "worst")


def _errors(rows: Sequence[Row]) -> str:
    reasons: dict[str, list[str]] = {}
    for row in errors_of(rows):
        reasons.setdefault(row["reason"], []).append(row["run"])
    shown = [[escape(reason), str(len(runs)), ", ".join(runs[:12])] for reason, runs in reasons.items()]
    return table(("reason", "runs", "which"), shown, "worst") if shown else ""


def _made_with(scenario: Scenario, plan: Plan, software: str) -> str:
    facts = {
        "scenario": scenario.path.name,
        "rig": scenario.file.rig,
        "runs": str(plan.count),
        "seed": str(plan.seed),
        "software": software,
    }
    facts |= {f"dispersion of {key}": _law(key, scenario) for key in scenario.file.dispersions}
    return table(("", ""), [[escape(name), escape(value)] for name, value in facts.items()], "provenance")


def _law(key: str, scenario: Scenario) -> str:
    row = scenario.file.dispersions[key]
    given = getattr(row, row.law)
    words = ", ".join(
        f"{value:g}" if isinstance(value, float) and math.isfinite(value) else str(value) for value in given
    )
    return f"{row.law.replace('_', ' ')} {words}" + (f", common {row.common}" if row.common else "")
