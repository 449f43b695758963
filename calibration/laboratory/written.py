"""A fitted laboratory as the `[laboratory]` part of a rig, and as numbers for other programs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from calibration.laboratory.findings import Findings, Found
from calibration.laboratory.procedure import FittedLaboratory, FittedVehicle
from calibration.result import Provenance
from groundstation.declarations.rig import Rig
from groundstation.files.json_file import json_text
from groundstation.files.toml_file import Value, toml_value
from groundstation.parts.imu.sections import ImuOfType

VALVE_KEYS = ("open_delay_s", "open_delay_sd_s", "close_delay_s", "rise_s", "sag")
IMU_KEYS = ("gyro_noise_rad_s", "acc_noise_m_s2")
CAMERA_KEYS = (
    "rate_hz",
    "delay_s",
    "delay_jitter_s",
    "sigma_xy_m",
    "sigma_heading_rad",
    "missing_fraction",
)


def laboratory_toml(fitted: FittedLaboratory, provenance: Provenance) -> str:
    """Return the tables; a key that the flight does not tell is left out, or named as the rig's."""
    rig, table = fitted.rig, fitted.rig.table
    lines = [
        "# The emulated laboratory of a rig, fitted to a flight. ± is one sigma.",
        f"# made {provenance.made_utc.isoformat(timespec='seconds')} from {provenance.recording}",
        f"# SHA-256 {provenance.recording_sha256}",
        "",
        "[laboratory]",
        'name = "emulator"',
        "",
        "[laboratory.table]",
        _line("bounds_m", [table.x_min_m, table.x_max_m, table.y_min_m, table.y_max_m], "by the rig"),
    ]
    found = fitted.table.found
    tilt = [found[f"table.tilt_rad.{axis}"] for axis in "xy"]
    spread = ", ".join(f"{each.sigma:.2g}" for each in tilt)
    lines.append(_line("tilt_rad", [each.value for each in tilt], f"± {spread}"))
    lines += _found(fitted.table, "table.", ("waviness_rad",))
    lines += _comments(fitted.table)
    for vehicle in fitted.vehicles:
        lines += _vehicle(rig, vehicle)
    for name, reason in fitted.grounded.items():
        lines += ["", f"# {name}: {reason}", *_standing(rig, name)]
    return "\n".join(lines) + "\n"


def _vehicle(rig: Rig, vehicle: FittedVehicle) -> Iterator[str]:
    kind, found = rig.type_of(vehicle.name), vehicle.findings
    x_m, y_m, heading_rad = vehicle.motion.start
    yield from (
        "",
        "[[laboratory.vehicles]]",
        _line("name", vehicle.name),
        _line("mass_kg", kind.mass_kg, "by the rig, taken as true"),
    )
    if "inertia_kg_m2" in found.found:
        yield from _found(found, "", ("inertia_kg_m2",))
    else:
        yield _line("inertia_kg_m2", kind.inertia_kg_m2, "by the rig, not seen")
    yield _line("start_m", [x_m, y_m], "where it took off")
    yield _line("start_heading_deg", math.degrees(heading_rad))
    yield from _found(found, "", ("drag_n_s_m", "drag_nm_s"))
    yield from _comments(found)
    for number, valve in enumerate(kind.model().valves):
        key = f"thrusters.{number}.thrust_n"
        yield from (
            "",
            "[[laboratory.vehicles.thrusters]]",
            _line("position_body_m", list(valve.position_body_m)),
            _line("direction_body", list(valve.direction_body)),
        )
        if key in found.found:
            yield from _found(found, f"thrusters.{number}.", ("thrust_n",))
        else:
            yield _line("thrust_n", valve.thrust_n, f"by the rig: {found.unseen[key]}")
    yield from ("", "[laboratory.vehicles.valves]", _line("spread", 0.0, "each valve is stated by itself"))
    yield from _found(found, "valves.", VALVE_KEYS)
    yield from _imu(rig, vehicle.name)
    yield from _found(found, "imu.", IMU_KEYS)
    yield from ("", "[laboratory.vehicles.camera]", _line("source", "fixes"))
    yield from _found(found, "camera.", CAMERA_KEYS)


def _imu(rig: Rig, vehicle: str) -> Iterator[str]:
    imu = rig.of_type(vehicle, ImuOfType).imu
    is_filtered = imu.gyro_bandwidth_hz > 0.0 or imu.acc_bandwidth_hz > 0.0
    yield from (
        "",
        "[laboratory.vehicles.imu]",
        _line("model", "datasheet" if is_filtered else "published"),
        _line("averaging", imu.averaging, "by the rig"),
        _line("baud", imu.baud, "by the rig"),
        _line("ftdi_latency_ms", max(1, round(1e3 * imu.ftdi_latency_s)), "by the rig"),
        _line("position_body_m", list(imu.position_body_m), "by the rig"),
    )


def _standing(rig: Rig, vehicle: str) -> Iterator[str]:
    hold = rig.vehicles[vehicle].hold
    yield from (
        "[[laboratory.vehicles]]",
        _line("name", vehicle),
        _line("mass_kg", rig.type_of(vehicle).mass_kg, "by the rig"),
        _line("start_m", [hold.x_m, hold.y_m], "its hold in the rig"),
        _line("start_heading_deg", hold.heading_deg),
    )
    yield from _imu(rig, vehicle)


def _line(key: str, value: Value, remark: str = "") -> str:
    return f"{key} = {toml_value(value)}" + (f"  # {remark}" if remark else "")


def _found(findings: Findings, prefix: str, keys: tuple[str, ...]) -> Iterator[str]:
    for key in keys:
        if found := findings.found.get(prefix + key):
            remark = f"; {found.remark}" if found.remark else ""
            yield _line(key, found.value, f"± {found.sigma:.2g} {found.unit}{remark}")


def _comments(findings: Findings) -> Iterator[str]:
    for sentence in findings.assumed:
        yield f"# taken as true: {sentence}"
    for key, reason in findings.unseen.items():
        yield f"# not found: {key}: {reason}"


def laboratory_json(fitted: FittedLaboratory, provenance: Provenance) -> str:
    """Return everything with its sigma, unit and reason."""
    return json_text(
        {
            "made_utc": provenance.made_utc.isoformat(timespec="seconds"),
            "recording": provenance.recording,
            "recording_sha256": provenance.recording_sha256,
            "warnings": list(fitted.warnings),
            "table": _plain(fitted.table),
            "vehicles": {
                each.name: {
                    **_plain(each.findings),
                    "flown_s": each.flight.flown_s,
                    "open_s": np.round(each.fit.on_s, 3).tolist(),
                    "openings": each.fit.openings.tolist(),
                }
                for each in fitted.vehicles
            },
            "did_not_fly": fitted.grounded,
        }
    )


def _plain(findings: Findings) -> dict[str, Any]:
    def numbers(found: Mapping[str, Found]) -> dict[str, dict[str, Any]]:
        return {
            key: {"value": each.value, "std": each.sigma, "unit": each.unit} for key, each in found.items()
        }

    return {
        "found": numbers(findings.found),
        "not_found": dict(findings.unseen),
        "taken_as_true": list(findings.assumed),
    }
