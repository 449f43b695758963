"""The report of a long flight of four mock-ups: time, and size of the page."""

import time
from pathlib import Path

from bench.limits import at_most
from bench.rows import RIGS, Bench, Row
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.rig.read import load_rig, read_text
from groundstation.watch.report import write_report

FLOWN_S = 600.0
NAMES = ("alpha", "beta", "gamma", "delta")
PLACES_M = ((-1.2, -0.7), (1.2, -0.7), (-1.2, 0.7), (1.2, 0.7))
SECONDS, AIM_S = 20.0, 8.0
MEGABYTES, AIM_MB = 5.0, 2.0


def measure(bench: Bench) -> list[Row]:
    """Fly once in lockstep, then report."""
    recording = fly(bench, FLOWN_S)
    out = bench.folder / "report"
    begin_s = time.perf_counter()
    write_report(recording, out, lambda text, _done: bench.say(f"report: {text}"))
    took_s = time.perf_counter() - begin_s
    page_mb = (out / "report.html").stat().st_size * 1e-6
    recorded_mb = recording.stat().st_size * 1e-6
    what = "report.html of 10 min with four mock-ups"
    return [
        at_most(f"{what}: time", took_s, SECONDS, AIM_S, "s", f"recording of {recorded_mb:.0f} MB"),
        at_most(f"{what}: size", page_mb, MEGABYTES, AIM_MB, "MB"),
    ]


def fly(bench: Bench, flown_s: float) -> Path:
    """Record four mock-ups with IMUs at 250 Hz and 15 drawn fixes a second."""
    rig, path = bench.folder / "four_mock_ups.toml", bench.folder / "four_mock_ups.mcap"
    rig.write_text(rig_text())
    run_lockstep(
        load_rig(rig), read_text(rig), rig, path, flown_s, 1, lambda text, _done: bench.say(f"report: {text}")
    )
    return path


def rig_text() -> str:
    """The rig of one mock-up with drawn fixes, with three more of them, and faster."""
    text = (RIGS / "drawn_fixes.toml").read_text()
    head, vehicle = text.split("[vehicles.alpha]\n")
    vehicle, laboratory = vehicle.split("[laboratory]\n")
    laboratory, emulated = laboratory.split("[[laboratory.vehicles]]\n")
    out = [head.replace("baud = 250000", "baud = 250000\naveraging = 4")]
    for index, (name, (x_m, y_m)) in enumerate(zip(NAMES, PLACES_M, strict=True)):
        own = vehicle.replace("alpha", name).replace("bus_index = 0", f"bus_index = {index}")
        own = own.replace("x_m = 0.2, y_m = 0.1", f"x_m = {x_m}, y_m = {y_m}")
        out.append(f"[vehicles.{name}]\n{own}")
    out.append(f"[laboratory]\n{laboratory}")
    for name, (x_m, y_m) in zip(NAMES, PLACES_M, strict=True):
        own = emulated.replace("alpha", name).replace("[0.0, 0.0]", f"[{0.9 * x_m}, {0.9 * y_m}]")
        own = own.replace("averaging = 10", "averaging = 4")
        own = own.replace("rate_hz = 1.5\ndelay_s = 0.6", "rate_hz = 15.0\ndelay_s = 0.015")
        out.append(f"[[laboratory.vehicles]]\n{own}")
    return "".join(out)
