"""Tables of supervision as rows for people: modes, transitions, checks of the arming gate, faults."""

from collections.abc import Iterable
from dataclasses import dataclass

from groundstation.supervision.arming import CHECKS
from groundstation.supervision.faults import CLEAR_S, FAULTS, Fault
from groundstation.supervision.mode_machine import GRACE_S, HOLD_S, LONGEST_BRAKING_S, NEW_PRESS_S
from groundstation.supervision.modes import GUARANTEES, TRANSITIONS, Air, Mode

PAGE = """# Modes and faults

What the supervisor of a vehicle guarantees, what moves it, and what it does about what goes wrong.

This page is made by `groundstation faults --markdown > docs/faults.md`. Change the tables, not the page.
"""
_AIR = {Air.OFF: "off", Air.ON: "on", Air.AS_WANTED: "on where flight is wanted"}


@dataclass(frozen=True, slots=True)
class Shown:
    """One table.

    Attributes:
        title: Of the table.
        text: What to know before reading it.
        headings: Of the columns.
        rows: Cells of each row.
    """

    title: str
    text: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def tables() -> tuple[Shown, ...]:
    """All of them, in the order in which a newcomer needs them."""
    return _modes(), _transitions(), _checks(), _faults()


def as_markdown(shown: Iterable[Shown]) -> str:
    """A page of the documentation."""
    parts = [PAGE]
    for table in shown:
        lines = [table.headings, tuple("---" for _ in table.headings), *table.rows]
        text = "\n".join(
            f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |" for row in lines
        )
        parts.append(f"\n## {table.title}\n\n{table.text}\n\n{text}\n")
    return "".join(parts)


def _modes() -> Shown:
    rows = tuple(
        (mode.value, guarantee.law.value, _yes(guarantee.may_open), _AIR[guarantee.air], guarantee.summary)
        for mode, guarantee in GUARANTEES.items()
    )
    text = (
        "What holds in each mode, whatever else goes wrong. `law` is what the valves carry out; the guard is "
        "armed where valves may open."
    )
    return Shown("Modes", text, ("mode", "law", "valves may open", "float air", "guarantee"), rows)


def _transitions() -> Shown:
    rows = tuple(
        (
            row.event.value,
            ", ".join(mode.value for mode in Mode if mode in row.before),
            row.after.value,
            row.who.value,
            row.cause + (" (arming gate)" if row.is_gated else ""),
        )
        for row in TRANSITIONS
    )
    text = (
        "What no row names is refused. Where a stop is latched, landing ends in `stopped`; where flight is "
        f"wanted, in `resting`. A stop brakes for at most {LONGEST_BRAKING_S:g} s, then holds {HOLD_S:g} s; "
        f"the valve node lands by itself after {GRACE_S:g} s. A new press at least {NEW_PRESS_S:g} s after "
        "the first is `stop_again`; repeats of a press are none. Braking for a fault that lands, and for a "
        "stop, is not taken back by `resume`."
    )
    return Shown("Transitions", text, ("event", "in", "leads to", "asked for by", "cause"), rows)


def _checks() -> Shown:
    rows = tuple((check.name, check.summary, _yes(check.may_be_overridden)) for check in CHECKS)
    text = "What must hold before `armed`. A refusal names the check; an override needs a reason."
    return Shown("Arming gate", text, ("check", "what must hold", "may be overridden"), rows)


def _faults() -> Shown:
    rows = tuple(
        (
            fault.id,
            fault.what,
            fault.found_by + (f", for {fault.confirm_s:g} s" if fault.confirm_s else ""),
            f"{fault.within_s:g} s",
            _steps(fault),
            fault.clears.value,
            _keeps_down(fault),
            fault.advice,
            ", ".join(fault.failures) or "-",
        )
        for fault in FAULTS.values()
    )
    text = (
        "Where faults disagree, the strongest response counts. A fault that clears by itself ends once "
        f"it has not been seen for {CLEAR_S:g} s; one that a person clears ends by `release` or `fly`, once "
        "it is gone. The last column names what `groundstation inject` can do to provoke it. The hub has no "
        "row: it lives in the launcher, and when that ends every process closes its valves and ends, and the "
        "valve nodes land by the silence."
    )
    headings = (
        "fault", "what is wrong", "found by", "within", "response", "clears", "keeps it down", "what to do",
        "failures",
    )  # fmt: skip
    return Shown("Faults", text, headings, rows)


def _steps(fault: Fault) -> str:
    return "; ".join(
        f"{response.words}{f' after {after_s:g} s' if after_s else ''}" for after_s, response in fault.steps
    )


def _keeps_down(fault: Fault) -> str:
    if not fault.blocks_arming:
        return "no"
    return "unless overridden" if fault.may_be_overridden else "yes"


def _yes(is_so: bool) -> str:
    return "yes" if is_so else "no"
