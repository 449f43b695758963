"""Contract of the failure table: every row acts, from its start and not before."""

import json
from pathlib import Path

import pytest
from pydantic import ValidationError

from drivers.valve_bus.protocol import Arm, ValveCommand, encode
from firmware_emulator.failures import FAILURE_KINDS, FailureConfig, Failures
from firmware_emulator.laboratory import EmulatedLaboratory

MS = 1_000_000
S = 1_000_000_000
START_S = 0.5
FILES = Path(__file__).parents[3] / "calibration" / "rigs" / "emulated"
STRONGER = {
    "bit_flips": {"probability_per_bit": 0.01},
    "lost_bytes": {"probability_per_byte": 0.05},
    "half_frames": {"probability_per_frame": 0.5},
    "false_lights": {"count": 20},
    "dead_star": {"star": 31},  # one that the camera sees
    "moved_star": {"star": 31},
}


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A small ceiling and a camera, so that camera failures have something to act on."""
    folder: Path = tmp_path_factory.mktemp("scene")
    rows = [f"{i},{0.31 * (i % 9) - 1.2},{0.27 * (i // 9) - 1.0}" for i in range(72)]
    (folder / "ceiling.csv").write_text("\n".join(["id,x_m,y_m", *rows]) + "\n")
    camera = {
        "width": 640, "height": 480, "fx": 600.0, "fy": 600.0, "cx": 320.0, "cy": 240.0,
        "dist_k1_k2_p1_p2_k3": [-0.1, 0.05, 0.0, 0.0, 0.0], "ceiling_height_above_camera_m": 2.2,
        "mount_offset_body_m": [0.03, -0.02, 0.0], "mount_yaw_rad": 0.03, "mount_tilt_x_rad": 0.0,
        "mount_tilt_y_rad": 0.0,
    }  # fmt: skip
    (folder / "camera.json").write_text(json.dumps(camera))
    return folder


def fly(scene, failures, source, *, has_overhead=False):
    camera = {"source": source, "rate_hz": 10.0, "delay_s": 0.05}
    if source == "rendered":
        camera |= {"ceiling": "ceiling.csv", "camera": "camera.json"}
    vehicle = {
        "name": "alpha",
        "floating": True,
        "start_velocity_m_s": [0.05, 0.0],
        "imu": {"ftdi_latency_ms": 1},
        "camera": camera,
    }
    config = {"folder": str(scene), "vehicles": [vehicle], "failures": failures}
    if has_overhead:
        files = {"camera": FILES / "overhead_camera.json", "circles": FILES / "circles.toml"}
        config["overhead"] = {"rate_hz": 4.0, **{key: str(path) for key, path in files.items()}}
    laboratory = EmulatedLaboratory(config, seed=11)
    arrivals = []
    laboratory.deliver(0, "valve_bus", encode(Arm(0, True)))
    for tick in range(1, 50):
        arrivals += laboratory.advance(tick * 20 * MS)
        on_times = (30,) * 4 + (0,) * 4 if tick % 5 == 0 else (0,) * 8
        command = ValveCommand(0, tick & 15, (tick // 5) & 15, on_times)
        laboratory.deliver(tick * 20 * MS, "valve_bus", encode(command))
    arrivals += laboratory.advance(S)
    return arrivals


def said(arrivals, until_ns=None):
    return [
        (a.stamp_ns, a.channel, a.data.image.tobytes() if hasattr(a.data, "image") else repr(a.data))
        for a in arrivals
        if until_ns is None or a.stamp_ns < until_ns
    ]


@pytest.mark.parametrize("kind", FAILURE_KINDS)
def test_every_failure_of_the_table_acts_and_only_from_its_start(scene, kind):
    source = "rendered" if FAILURE_KINDS[kind].device in ("camera", "sky") else "fixes"
    failure = {"kind": kind, "vehicle": "alpha", "start_s": START_S, "parameters": STRONGER.get(kind, {})}
    has_overhead = FAILURE_KINDS[kind].device == "overhead"
    healthy, ill, again = (
        fly(scene, failures, source, has_overhead=has_overhead) for failures in ([], [failure], [failure])
    )
    start_ns = round(START_S * S)
    assert said(ill, start_ns) == said(healthy, start_ns)
    assert said(ill) != said(healthy)
    assert said(ill) == said(again)


@pytest.mark.parametrize("kind", [k for k, row in FAILURE_KINDS.items() if row.device == "camera"])
def test_camera_failures_act_on_drawn_fixes_too(scene, kind):
    failure = {"kind": kind, "vehicle": "alpha", "start_s": START_S}
    assert said(fly(scene, [failure], "fixes")) != said(fly(scene, [], "fixes"))


@pytest.mark.parametrize("kind", FAILURE_KINDS)
def test_every_parameter_may_be_given_and_no_other(kind):
    row = FAILURE_KINDS[kind]
    FailureConfig(kind=kind, vehicle="alpha", parameters=dict(row.parameters))
    with pytest.raises(ValidationError, match="has no parameter 'sorcery'"):
        FailureConfig(kind=kind, vehicle="alpha", parameters={"sorcery": 1.0})


def test_a_failure_of_an_unknown_vehicle_or_valve_is_refused():
    with pytest.raises(ValidationError, match="names vehicle 'gamma'"):
        EmulatedLaboratory(
            {"vehicles": [{"name": "alpha"}], "failures": [{"kind": "dead_sky", "vehicle": "gamma"}]}
        )
    with pytest.raises(ValidationError, match=r"valve .* must lie in 0\.\.7"):
        FailureConfig(kind="leaking_valve", vehicle="alpha", parameters={"valve": 8})


def test_a_failure_that_ends_before_it_starts_is_refused():
    with pytest.raises(ValidationError, match="ends"):
        FailureConfig(kind="dead_sky", vehicle="alpha", start_s=5.0, end_s=4.0)


def test_edges_are_those_of_the_device_asked_for():
    rows = [
        FailureConfig(kind="dead_sky", vehicle="alpha", start_s=1.0, end_s=2.0),
        FailureConfig(kind="leaking_valve", vehicle="alpha", start_s=3.0),
        FailureConfig(kind="leaking_valve", vehicle="beta", start_s=4.0),
    ]
    failures = Failures.of_vehicle(rows, "alpha")
    assert failures.edges_ns("valves") == [3 * S]
    assert failures.edges_ns("camera") == [S, 2 * S]
    assert failures.active("leaking_valve", 4 * S).parameters == {"valve": 0.0, "fraction": 0.1}
