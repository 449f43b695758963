"""Flights of an emulated laboratory with hidden, drawn values: what `calibrate laboratory` is judged by.

    python tools/laboratory_flights.py 1 2 3 --folder build

records a flight for each seed (`hidden_1.mcap`) and writes what was hidden beside it (`hidden_1.json`).
The rig that the recording carries states nothing of it: its `[laboratory]` is the one with the drawn values,
which `calibrate laboratory` does not read.
"""

import argparse
import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from groundstation.declarations.request import Request
from groundstation.recording.writer import Recorder
from groundstation.rig.provenance import recording_info
from groundstation.rig.read import parse_rig
from groundstation.runners.make_runner import make_runner

REST_S, LEG_S, FLIGHT_S = 8.0, 9.0, 100.0
GRAVITY_M_S2 = 9.80665
STATION = """
name = "a laboratory that nobody has measured"
valve_bus = "laboratory:valve_bus"
table = { x_min_m = -2.0, x_max_m = 2.0, y_min_m = -1.5, y_max_m = 1.5 }

[mock_ups.standard]
valves = { open_delay_s = OPEN, close_delay_s = CLOSE, rise_s = RISE, min_on_s = LEAST }

[mock_ups.standard.imu]
baud = 250000
averaging = 4
ftdi_latency_s = 0.001
position_body_m = [0.03151, -0.02122]
gyro_density_rad_s_rthz = 6.7e-5
acc_density_m_s2_rthz = 6.5e-5

[mock_ups.standard.fusion]
rest_s = 6.0

[mock_ups.standard.control]
controller = "go_to"

[vehicles.alpha]
mock_up = "standard"
bus_index = 0
imu = "laboratory:alpha/imu"
fixes = "laboratory:alpha/fixes"
reference = "laboratory:alpha/reference"
hold = { x_m = -0.8, y_m = -0.3, heading_deg = 0.0 }
"""
"""What the station believes: nominal values, and delays that are off by up to `DELAY_OFF_S`."""
LEAST_OPEN_S = 0.01
"""A pulse shorter than the delay of opening opens nothing: a lab with slow valves asks for longer ones."""
DELAY_OFF_S = 0.0005
"""A station that is further off takes its valves for broken."""
PLACES = tuple(
    ((x, y), push)
    for push, sites in (
        ((1.0, 0.0), ((-0.15, 0.15), (-0.15, -0.15))),
        ((-1.0, 0.0), ((0.15, 0.15), (0.15, -0.15))),
        ((0.0, 1.0), ((0.15, -0.15), (-0.15, -0.15))),
        ((0.0, -1.0), ((0.15, 0.15), (-0.15, 0.15))),
    )
    for x, y in sites
)
"""Where the valves sit and push, as the station believes, too."""


@dataclass(frozen=True)
class Hidden:
    """What a laboratory is, and the station does not know; names as `calibrate laboratory` reports them."""

    thrust_n: tuple[float, ...]
    open_delay_s: float
    close_delay_s: float
    rise_s: float
    tilt_rad: tuple[float, float]
    gyro_noise_rad_s: float
    acc_noise_m_s2: float
    delay_s: float
    delay_jitter_s: float
    sigma_xy_m: float
    sigma_heading_rad: float
    missing_fraction: float


def drawn(seed: int) -> Hidden:
    """Draw a laboratory."""
    rng = np.random.default_rng([seed, 11])
    gyro, acc, fix = np.exp(rng.uniform(math.log(0.5), math.log(2.0), 3)).tolist()
    return Hidden(
        tuple((0.22 * rng.uniform(0.85, 1.15, 8)).tolist()),
        float(rng.uniform(0.005, 0.025)),
        float(rng.uniform(0.005, 0.025)),
        float(rng.uniform(0.003, 0.008)),
        tuple(rng.uniform(-5e-4, 5e-4, 2).tolist()),
        0.0017453292519943296 * gyro,
        0.002 * acc,
        float(rng.uniform(0.01, 0.06)),
        float(rng.uniform(0.0005, 0.004)),
        0.001 * fix,
        0.00087 * fix,
        float(rng.uniform(0.0, 0.2)),
    )


def station(hidden: Hidden, seed: int) -> str:
    """The rig's tables without the laboratory."""
    rng = np.random.default_rng([seed, 13])
    off_s = rng.uniform(-DELAY_OFF_S, DELAY_OFF_S, 3).tolist()
    open_s, close_s = hidden.open_delay_s + off_s[0], hidden.close_delay_s + off_s[1]
    text = STATION.replace("OPEN", f"{open_s:.4f}").replace("CLOSE", f"{close_s:.4f}")
    text = text.replace("RISE", f"{hidden.rise_s + off_s[2]:.4f}")
    return text.replace("LEAST", f"{open_s + LEAST_OPEN_S:.3f}")


def laboratory(hidden: Hidden) -> str:
    """The `[laboratory]` table of a drawn laboratory."""
    thrusters = "".join(
        f"{{ position_body_m = {list(place)}, direction_body = {list(push)}, thrust_n = {thrust_n!r} }}, "
        for (place, push), thrust_n in zip(PLACES, hidden.thrust_n, strict=True)
    )
    return f"""
[laboratory]
name = "emulator"
table = {{ bounds_m = [-2.0, 2.0, -1.5, 1.5], tilt_rad = {list(hidden.tilt_rad)} }}

[[laboratory.vehicles]]
name = "alpha"
start_m = [-0.8, -0.3]
thrusters = [{thrusters}]
valves = {{ open_delay_s = {hidden.open_delay_s!r}, close_delay_s = {hidden.close_delay_s!r}, \
rise_s = {hidden.rise_s!r}, spread = 0.0 }}
imu = {{ averaging = 4, ftdi_latency_ms = 1, gyro_noise_rad_s = {hidden.gyro_noise_rad_s!r}, \
acc_noise_m_s2 = {hidden.acc_noise_m_s2!r} }}
camera = {{ source = "fixes", rate_hz = 15.0, delay_s = {hidden.delay_s!r}, \
delay_jitter_s = {hidden.delay_jitter_s!r}, sigma_xy_m = {hidden.sigma_xy_m!r}, \
sigma_heading_rad = {hidden.sigma_heading_rad!r}, missing_fraction = {hidden.missing_fraction!r} }}
"""


def record(seed: int, path: Path, flight_s: float = FLIGHT_S) -> Hidden:
    """Fly to and fro in a drawn laboratory, in lockstep, into a recording."""
    hidden = drawn(seed)
    text = station(hidden, seed) + laboratory(hidden)
    rig_path = path.with_suffix(".toml")
    rig = parse_rig(text, rig_path)
    recorder = Recorder(path, recording_info(rig, text, rig_path, seed, utc_offset_ns=None))
    until_s = REST_S + flight_s
    runner = make_runner(rig, seed, [recorder.record], requests=_legs(seed, until_s))
    try:
        runner.run(round(until_s * 1e9))
    finally:
        runner.close()
    recorder.finish()
    return hidden


def _legs(seed: int, until_s: float) -> Iterator[Request]:
    rng = np.random.default_rng([seed, 12])
    for number in range(int((until_s - REST_S - 4.0) / LEG_S)):
        side = 1.0 if number % 2 else -1.0
        goal = {
            "x_m": -0.8 * side * float(rng.uniform(0.5, 1.0)),
            "y_m": float(rng.uniform(-0.7, 0.7)),
            "heading_rad": float(rng.uniform(-3.0, 3.0)),
        }
        stamp_ns = round((REST_S + 4.0 + LEG_S * number) * 1e9)
        yield Request(stamp_ns, "alpha", number + 1, "laboratory", "go_to", json.dumps(goal))


def main() -> None:
    """Record what is asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--folder", type=Path, default=Path())
    parser.add_argument("--flight-s", type=float, default=FLIGHT_S)
    given = parser.parse_args()
    for seed in given.seeds:
        path = given.folder / f"hidden_{seed}.mcap"
        hidden = record(seed, path, given.flight_s)
        path.with_suffix(".json").write_text(json.dumps(asdict(hidden), indent=1) + "\n")
        print(path)


if __name__ == "__main__":
    main()
