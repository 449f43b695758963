"""How many mock-ups fly in closed loop in real time here: live, recorded, no fault, no state missing.

One more at a time until it fails; the largest number that flew counts. Rendered: each has a camera of 10
frames a second whose pictures are rendered, found and solved. Drawn: fixes come from the laboratory.
"""

import subprocess
import sys

from bench.rows import ROOT, Bench, Row
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.recording.reader import Recording

FLOWN_S, WARM_UP_S = 45.0, 20.0
APART_M = 0.9
STATES_HZ, SHARE = 250.0, 0.97
CASES = {"rendered cameras at 10 frames/s": (3, 4, 6), "fixes at source": (6, 10, 12)}
"""Must, aim, and the most that is tried."""
CEILING = (ROOT / "calibration" / "rigs" / "emulated").as_posix()
DRAWN = '{ source = "fixes", rate_hz = 15.0, delay_s = 0.015 }'
RENDERED = (
    '{ source = "rendered", rate_hz = 10.0, delay_s = 0.015, exposure_s = 0.01, '
    f'ceiling = "{CEILING}/ceiling.csv", camera = "{CEILING}/camera.json" }}'
)
HEAD = """
name = "crowd"
valve_bus = "laboratory:valve_bus"
[table]
x_min_m = -2.0
x_max_m = 2.0
y_min_m = -1.5
y_max_m = 1.5
[mock_ups.standard.imu]
baud = 250000
averaging = 4
ftdi_latency_s = 0.001
position_body_m = [0.03151, -0.02122]
gyro_density_rad_s_rthz = 6.7e-5
acc_density_m_s2_rthz = 6.5e-5
"""
CAMERA = f"""
[mock_ups.standard.star_camera]
camera = "{CEILING}/camera.json"
ceiling = "{CEILING}/ceiling.csv"
delay_s = 0.015
delay_sigma_s = 0.001
exposure_s = 0.01
sigma_xy_m = 0.0002
sigma_heading_rad = 0.0002
"""
LABORATORY = """
[laboratory]
name = "emulator"
seed = 1
[laboratory.table]
bounds_m = [-2.0, 2.0, -1.5, 1.5]
tilt_rad = [0.0003, -0.0001]
"""


def measure(bench: Bench) -> list[Row]:
    """A row per kind of fixes."""
    return [_row(bench, kind, *limits) for kind, limits in CASES.items()]


def _row(bench: Bench, kind: str, must: int, aim: int, most: int) -> Row:
    flown, why = 0, ""
    for count in range(must - 1, most + 1):
        bench.say(f"crowd: {count} mock-ups, {kind}")
        why = _trouble(bench, kind, count)
        if why:
            break
        flown = count
    ended = f"; {flown + 1}: {why}" if why else ""
    return Row(
        f"mock-ups in closed loop in real time, live, {kind}",
        f"{must}, aim {aim}",
        f"{flown}{ended}",
        flown >= must,
    )


def _trouble(bench: Bench, kind: str, count: int) -> str:
    """Why so many could not fly; empty if they did."""
    rig, path = bench.folder / f"crowd_{count}.toml", bench.folder / f"crowd_{count}.mcap"
    rig.write_text(rig_text(kind, count), encoding="utf-8")
    words = ["run", str(rig), "--headless", "--no-console", "--duration", str(FLOWN_S), "--record", str(path)]
    done = subprocess.run(
        [sys.executable, "-m", "groundstation", *words], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if done.returncode:
        return f"ended with code {done.returncode}"
    with Recording(path) as recording:
        for number in range(count):
            why = _trouble_of(recording, f"m{number}")
            if why:
                return f"m{number} {why}"
    path.unlink()
    return ""


def _trouble_of(recording: Recording, vehicle: str) -> str:
    begin_ns = recording.start_ns + round(WARM_UP_S * 1e9)
    faults, modes, states = set(), set(), 0
    last_ns = begin_ns
    for message in recording.messages([Faults, Supervision, VehicleState], [vehicle]):
        payload, now_ns = message.payload, message.envelope.publish_ns
        if now_ns < begin_ns:
            continue
        last_ns = max(last_ns, now_ns)
        if isinstance(payload, Faults):
            faults.update(payload.ids)
        elif isinstance(payload, Supervision):
            modes.add(payload.mode)
        else:
            states += 1
    if faults:
        return f"has {', '.join(sorted(faults))}"
    if modes != {"flying"}:
        return f"is {', '.join(sorted(modes)) or 'silent'}"
    wanted = SHARE * STATES_HZ * (last_ns - begin_ns) * 1e-9
    return "" if states >= wanted else f"has {states} states of {wanted:.0f}"


def rig_text(kind: str, count: int) -> str:
    """A rig of so many mock-ups, four in a row, on the table under the emulated ceiling."""
    is_drawn = kind == "fixes at source"
    address = "fixes" if is_drawn else "star_camera"
    vehicles, laboratory = [], []
    for number in range(count):
        x_m, y_m = APART_M * (number % 4 - 1.5), APART_M * (number // 4 - 1)
        name = f"m{number}"
        vehicles.append(
            f'[vehicles.{name}]\nmock_up = "standard"\nbus_index = {number}\nimu = "laboratory:{name}/imu"\n'
            f'{address} = "laboratory:{name}/{address}"\nreference = "laboratory:{name}/reference"\n'
            f"hold = {{ x_m = {x_m:g}, y_m = {y_m:g}, heading_deg = 0.0 }}\n"
        )
        laboratory.append(
            f'[[laboratory.vehicles]]\nname = "{name}"\nstart_m = [{x_m:g}, {y_m:g}]\n'
            'imu = { model = "published", averaging = 4, ftdi_latency_ms = 1 }\n'
            f"camera = {DRAWN if is_drawn else RENDERED}\n"
        )
    return "\n".join((HEAD, "" if is_drawn else CAMERA, *vehicles, LABORATORY, *laboratory))
