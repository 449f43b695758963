"""One vehicle for people: as the cells of a table, and as one line of a log."""

import math
from typing import TypeVar

from rich.text import Text

from groundstation.frames import wrap_angle
from groundstation.messages import definitions as m
from groundstation.messages.base import Message
from groundstation.runtime.monitor import VehicleMonitor

Kind = TypeVar("Kind", bound=Message)

LABELS = (
    "phase",
    "valves",
    "commanded by",
    "position, heading",
    "off its goal",
    "  rms of 30 s, by truth",
    "estimate, rms by truth",
    "IMU",
    "star fixes",
    "  innovation, NIS",
    "  refused",
    "  not used",
    "tank",
)

OLD_FIX_S = 3.0
_GOOD, _BAD, _DIM, _WARN = "green", "red", "bright_black", "yellow"
_NOTHING = Text("-", style=_DIM)
_LEVEL = {"flying": _GOOD, "stopped": _BAD, "disarmed": _WARN}


def rows_of(vehicle: VehicleMonitor, now_ns: int) -> list[Text]:
    """Cells in the order of ``LABELS``."""
    return [
        _phase(vehicle),
        _valves(vehicle),
        _source(vehicle),
        _pose(vehicle),
        _off_goal(vehicle),
        _pair(vehicle.station_errors.rms()),
        _pair(vehicle.estimate_errors.rms()),
        _imu(vehicle, now_ns),
        _fixes(vehicle, now_ns),
        _innovation(vehicle),
        _refused(vehicle),
        _counts(vehicle.unused, Text(overflow="ellipsis")) if vehicle.unused else _NOTHING,
        _tank(vehicle),
    ]


def line_of(vehicle: VehicleMonitor, now_ns: int) -> str:
    """The most important of it in one line of fixed columns."""
    phase = _newest(vehicle, m.SequencePhase)
    command = _newest(vehicle, m.ValveCommand)
    state = _newest(vehicle, m.VehicleState)
    imu = _newest(vehicle, m.Imu)
    fusion = _newest(vehicle, m.FusionStatus)
    x, y, heading = (
        (math.nan,) * 3
        if state is None
        else (*(1e3 * value for value in state.position_table_m), math.degrees(state.heading_rad))
    )
    off_m, off_rad = _distance(vehicle)
    estimate_m, estimate_rad = vehicle.estimate_errors.rms()
    age_s = math.inf if fusion is None else fusion.fix_age_s
    used, refused = (0, 0) if fusion is None else (fusion.fixes_used, fusion.fixes_refused)
    return (
        f"{'-' if phase is None else phase.phase:<16} {'-' if command is None else command.gate:<8} "
        f"{_figure(x, 8, 1)} {_figure(y, 8, 1)} mm {_figure(heading, 7, 2)} deg  "
        f"off {_figure(off_m * 1e3, 6, 1)} mm {_figure(math.degrees(off_rad), 6, 2)} deg  "
        f"est {_figure(estimate_m * 1e3, 5, 2)} mm {_figure(math.degrees(estimate_rad), 5, 3)} deg  "
        f"imu {vehicle.rate_hz(m.Imu, now_ns):3.0f}/s lost {0 if imu is None else imu.frames_lost}  "
        f"fix {vehicle.rate_hz(m.StarFix, now_ns):4.1f}/s age {_figure(age_s, 4, 2)} s "
        f"used {used} refused {refused}"
        f"{_no_fix(vehicle)}"
    )


def _figure(value: float, width: int, digits: int) -> str:
    """A number of fixed width; a dash while there is none."""
    return f"{value:{width}.{digits}f}" if math.isfinite(value) else f"{'-':>{width}}"


def _no_fix(vehicle: VehicleMonitor) -> str:
    """Why the newest picture gave no fix, and how many gave none for that; empty if it gave one."""
    fix = _newest(vehicle, m.StarFix)
    if fix is None or fix.fix:
        return ""
    kind = fix.reason.partition(":")[0]
    return f"  no fix: {kind} ({vehicle.refused.get(kind, 0)} x)"


def _newest(vehicle: VehicleMonitor, kind: type[Kind]) -> Kind | None:
    found = vehicle.newest.get(kind)
    return found if isinstance(found, kind) else None


def _phase(vehicle: VehicleMonitor) -> Text:
    phase = _newest(vehicle, m.SequencePhase)
    if phase is None:
        return _NOTHING
    text = phase.phase + (f" ({phase.detail})" if phase.detail else "")
    return Text(text, style=_LEVEL.get(phase.phase, ""), overflow="ellipsis")


def _valves(vehicle: VehicleMonitor) -> Text:
    mode, command = _newest(vehicle, m.VehicleMode), _newest(vehicle, m.ValveCommand)
    status = _newest(vehicle, m.ValveStatus)
    if command is None:
        return _NOTHING
    armed = mode is not None and mode.armed
    words = f"{'armed' if armed else 'disarmed'}, {command.gate} "
    gate = Text(words, style=_GOOD if command.gate == "open" else _WARN)
    mask = status.open_mask if status is not None else 0
    lamps = Text("".join("●" if mask >> valve & 1 else "·" for valve in range(8)))
    if status is not None and status.dead_man:
        lamps.append(" dead man", style=_BAD)
    return gate + lamps


def _source(vehicle: VehicleMonitor) -> Text:
    selection = _newest(vehicle, m.ValveSelection)
    if selection is None:
        return _NOTHING
    text = selection.source + (f": {selection.reason}" if selection.reason else "")
    return Text(text, style=_WARN if selection.source in ("stop", "brake") else "", overflow="ellipsis")


def _pose(vehicle: VehicleMonitor) -> Text:
    state = _newest(vehicle, m.VehicleState)
    if state is None:
        return _NOTHING
    x, y = state.position_table_m
    text = Text(f"{x * 1e3:8.1f} {y * 1e3:8.1f} mm {math.degrees(state.heading_rad):8.2f} deg")
    if state.status == "lost":
        text.append("  LOST", style=_BAD)
    return text


def _distance(vehicle: VehicleMonitor) -> tuple[float, float]:
    """Estimate to goal, now: m and rad; NaN without either."""
    state, goal = _newest(vehicle, m.VehicleState), _newest(vehicle, m.ControlStatus)
    if state is None or goal is None:
        return math.nan, math.nan
    turn = wrap_angle(goal.goal_heading_rad - state.heading_rad)
    return math.dist(state.position_table_m, goal.goal_position_table_m), turn


def _off_goal(vehicle: VehicleMonitor) -> Text:
    return _pair(_distance(vehicle))


def _imu(vehicle: VehicleMonitor, now_ns: int) -> Text:
    imu = _newest(vehicle, m.Imu)
    if imu is None:
        return _NOTHING
    rate = vehicle.rate_hz(m.Imu, now_ns)
    text = Text(f"{rate:5.0f} /s", style="" if rate else _BAD)
    text.append(f"  {imu.frames_lost} lost", style=_WARN if imu.frames_lost else _DIM)
    if not imu.valid:
        text.append(f"  {imu.reason}", style=_BAD)
    return text


def _fixes(vehicle: VehicleMonitor, now_ns: int) -> Text:
    fusion = _newest(vehicle, m.FusionStatus)
    if fusion is None:
        return _NOTHING
    text = Text(f"{vehicle.rate_hz(m.StarFix, now_ns):5.1f} /s")
    text.append(f"  {fusion.fixes_used} used, {fusion.fixes_refused} refused", style=_DIM)
    if math.isfinite(fusion.fix_age_s):
        text.append(f"  age {fusion.fix_age_s:.2f} s", style=_BAD if fusion.fix_age_s > OLD_FIX_S else "")
    return text


def _refused(vehicle: VehicleMonitor) -> Text:
    """Why there is no fix now, and how often each reason was given, the most frequent first."""
    if not vehicle.refused:
        return _NOTHING
    fix = _newest(vehicle, m.StarFix)
    text = Text(overflow="ellipsis")
    if fix is not None and not fix.fix:
        text.append("now: ", style=_BAD).append(fix.reason.partition(":")[0], style=_BAD).append("; ")
    return _counts(vehicle.refused, text)


def _counts(by_reason: dict[str, int], text: Text) -> Text:
    counts = sorted(by_reason.items(), key=lambda item: -item[1])
    return text.append(", ".join(f"{count} x {reason}" for reason, count in counts), style=_DIM)


def _innovation(vehicle: VehicleMonitor) -> Text:
    """How far the newest fix lay from what was expected, and the mean NIS of the last ones (3 expected)."""
    account = _newest(vehicle, m.FixAccount)
    if account is None or math.isnan(account.nis):
        return _NOTHING
    x, y, turn = account.innovation
    style = "" if account.used else _BAD
    text = Text(f"{math.hypot(x, y) * 1e3:8.2f} mm {math.degrees(turn):8.3f} deg", style=style)
    text.append(f"  {account.nis:.1f}")
    if vehicle.nis:
        text.append(f", mean {sum(vehicle.nis) / len(vehicle.nis):.1f} of 3", style=_DIM)
    return text


def _tank(vehicle: VehicleMonitor) -> Text:
    status = _newest(vehicle, m.ValveStatus)
    if status is None or math.isnan(status.pressure_pa):
        return _NOTHING
    return Text(f"{status.pressure_pa * 1e-5:.0f} bar" + ("" if status.floating else ", float air off"))


def _pair(values: tuple[float, float]) -> Text:
    position_m, heading_rad = values
    if math.isnan(position_m):
        return _NOTHING
    return Text(f"{position_m * 1e3:8.2f} mm {math.degrees(heading_rad):8.3f} deg")
