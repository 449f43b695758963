"""``groundstation status``: every running rig on one screen."""

import json
import math
import shutil
import textwrap
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from typing import Annotated, Any

import typer

from groundstation.declarations.errors import GroundStationError
from groundstation.launch.observer import POLL_S, observing
from groundstation.launch.running import RunningRig, find_running
from groundstation.watch.glance import KINDS, LIGHT_TO_VALVE, Glance

app = typer.Typer(rich_markup_mode=None)

LOOKS_S = 2.5
"""What is latched is repeated each second; who has published nothing by then has nothing to report."""
_GAP = "  "
_UNDER = 12 * " "


@app.command()
def status(
    as_json: Annotated[bool, typer.Option("--json", help="One JSON list, SI, null for unknown.")] = False,
    pid: Annotated[int | None, typer.Option(help="Only the run of this process.")] = None,
) -> None:
    """Show every rig that runs here: modes, air, gas, faults, who has control, recorder, latency.

    It looks for 2.5 s at most. Exit code 0; 1 where a rig cannot be reached.

    Example: groundstation status
    """
    runs = [run for run in find_running() if pid in (None, run.pid)]
    if not runs:
        print("[]" if as_json else "no rig is running: start one with `groundstation run`")
        return
    with ThreadPoolExecutor(len(runs)) as pool:
        seen = list(pool.map(_look, runs))
    if as_json:
        print(json.dumps(seen, indent=1))
    else:
        print("\n\n".join("\n".join(_lines(rig)) for rig in seen))
    if any("trouble" in rig for rig in seen):
        raise typer.Exit(1)


def _look(run: RunningRig) -> dict[str, Any]:
    """What a rig reports of itself."""
    glance = Glance(run.vehicles)
    until_s = time.monotonic() + LOOKS_S
    try:
        with observing(run.endpoint, KINDS) as observer:
            while time.monotonic() < until_s and not glance.is_complete:
                for recorded in observer.take():
                    glance.take(recorded)
                time.sleep(POLL_S)  # a mailbox is looked into: no thread of Python waits for it
    except GroundStationError as error:
        return asdict(run) | {"trouble": str(error)}
    known = {"pid": run.pid, "rig": run.rig, "endpoint": run.endpoint}
    seen = glance.as_dict(time.monotonic_ns())
    if seen["recorder"] is None and run.recording:
        seen["recorder"] = _stopped(run)
    return known | seen


def _stopped(run: RunningRig) -> dict[str, Any]:
    """What is known of a recorder that was asked for and reports nothing."""
    newest = next((other for other in find_running() if other == run), run)  # than before the look
    why = newest.recorder_stop or f"nothing has come from it within {LOOKS_S:g} s"
    unknown = dict.fromkeys(("written_bytes", "free_bytes", "room_s"))
    return {"is_stopped": True, "trouble": why, "path": run.recording, **unknown}


def _lines(rig: dict[str, Any]) -> Iterator[str]:
    """A rig for people; no line is longer than the terminal, unless it is about trouble."""
    if "trouble" in rig:
        yield from _whole_lines(rig)
        return
    width = shutil.get_terminal_size().columns
    for line in _whole_lines(rig):
        yield line if len(line) <= width else f"{line[: width - 1]}…"


def _whole_lines(rig: dict[str, Any]) -> Iterator[str]:
    yield f"{rig['rig']} (process {rig['pid']}, {rig['endpoint']})"
    if "trouble" in rig:
        yield f"  NOT REACHED: {rig['trouble']}"
        return
    yield f"  control   {_control(rig['control'])}"
    yield f"  recorder  {_recorder(rig['recorder'])}"
    if rig["recorder"] and rig["recorder"]["trouble"]:
        yield from textwrap.wrap(
            rig["recorder"]["trouble"],
            shutil.get_terminal_size().columns,
            initial_indent=_UNDER,
            subsequent_indent=_UNDER,
        )
    yield ""
    rows = [("", "mode", "air", "tank", "last fix", "light to valve, p50 / p99")]
    rows += [
        (name, seen["mode"] or "-", _air(seen), _tank(seen), _age(seen["fix_age_s"]), _ages(seen))
        for name, seen in rig["vehicles"].items()
    ]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield "  " + _GAP.join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
    yield ""
    for name, seen in rig["vehicles"].items():
        yield from _told(name, seen)


def _told(name: str, seen: dict[str, Any]) -> Iterator[str]:
    """Why it is in its mode, and its faults."""
    if seen["mode"] is None:
        yield f"  {name}: no ruling was published within {LOOKS_S:g} s"
        return
    whose = f", by {seen['author']}" if seen["author"] else ""
    waits = f"; waits for {seen['waits_for'][0]}" if seen["waits_for"] else ""
    yield f"  {name}: {seen['mode']}: {seen['cause']}{whose}{waits}"
    for fault in seen["faults"] or ():
        state = "gone, release clears it" if fault["is_gone"] else f"for {fault['since_s']:.0f} s"
        yield f"  {name}: FAULT {fault['id']} ({state}): {fault['what']} It {fault['response']}."


def _control(control: dict[str, Any]) -> str:
    if control["holder"] is None:
        return "-"
    if not control["holder"]:
        return "nobody holds it"
    minutes, seconds = divmod(math.ceil(control["expires_s"]), 60)
    return f"{control['holder']}, for another {minutes}:{seconds:02d}"


def _recorder(recorder: dict[str, Any] | None) -> str:
    if recorder is None:
        return "none"
    if recorder["is_stopped"]:
        return f"STOPPED: {recorder['path']}"
    room = recorder["room_s"]
    lasts = "" if room is None else f", room for {room / 3600:.3g} h"
    return (
        f"{recorder['written_bytes'] / 1e6:.1f} MB, {recorder['free_bytes'] / 1e9:.3g} GB free{lasts}: "
        f"{recorder['path']}"
    )


def _air(seen: dict[str, Any]) -> str:
    if seen["air_on"] is None:
        return "-"
    words = "on" if seen["air_on"] else "off"
    return words if seen["air_ordered"] in (None, seen["air_on"]) else f"{words} (ordered otherwise)"


def _tank(seen: dict[str, Any]) -> str:
    return "-" if seen["pressure_pa"] is None else f"{seen['pressure_pa'] * 1e-5:.0f} bar"


def _age(age_s: float | None) -> str:
    return "-" if age_s is None else f"{age_s:.2f} s"


def _ages(seen: dict[str, Any]) -> str:
    ages = (seen["latency_s"] or {}).get(LIGHT_TO_VALVE, {})
    if ages.get("p50") is None or ages.get("p99") is None:
        return "-"
    return f"{1e3 * ages['p50']:.1f} / {1e3 * ages['p99']:.1f} ms"
