"""Contract of the failure table: every row acts, from its start and not before."""

import json
import math
from pathlib import Path

import pytest
from pydantic import ValidationError

from drivers.imu_block.protocol import encode_identify
from drivers.valve_bus.protocol import Arm, ValveCommand, encode
from firmware_emulator.failures import FAILURE_KINDS, Failure, FailureConfig, Failures
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
        if tick % 10 == 0:
            laboratory.deliver(tick * 20 * MS, "alpha/imu", encode_identify(tick))
        laboratory.deliver(tick * 20 * MS, "valve_bus", encode(command))
    arrivals += laboratory.advance(S)
    return arrivals


def reported(arrivals, until_ns=None):
    return [
        (a.stamp_ns, a.channel, a.data.image.tobytes() if hasattr(a.data, "image") else repr(a.data))
        for a in arrivals
        if a.channel != "laboratory" and (until_ns is None or a.stamp_ns < until_ns)
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
    assert reported(ill, start_ns) == reported(healthy, start_ns)
    assert reported(ill) != reported(healthy)
    assert reported(ill) == reported(again)


@pytest.mark.parametrize("kind", [k for k, row in FAILURE_KINDS.items() if row.device == "camera"])
def test_camera_failures_act_on_drawn_fixes_too(scene, kind):
    failure = {"kind": kind, "vehicle": "alpha", "start_s": START_S}
    assert reported(fly(scene, [failure], "fixes")) != reported(fly(scene, [], "fixes"))


@pytest.mark.parametrize("kind", FAILURE_KINDS)
def test_every_parameter_may_be_given_and_no_other(kind):
    defaults = {name: parameter.default for name, parameter in FAILURE_KINDS[kind].parameters.items()}
    FailureConfig(kind=kind, vehicle="alpha", parameters=defaults)
    with pytest.raises(ValidationError, match="has no parameter 'sorcery'"):
        FailureConfig(kind=kind, vehicle="alpha", parameters={"sorcery": 1.0})


def test_a_failure_of_an_unknown_vehicle_or_valve_is_refused():
    with pytest.raises(ValidationError, match="names vehicle 'gamma'"):
        EmulatedLaboratory(
            {"vehicles": [{"name": "alpha"}], "failures": [{"kind": "dead_sky", "vehicle": "gamma"}]}
        )
    with pytest.raises(ValidationError, match=r"valve .* must lie in 0\.\.7"):
        FailureConfig(kind="leaking_valve", vehicle="alpha", parameters={"valve": 8})


@pytest.mark.parametrize(
    ("kind", "vehicle", "reason"),
    [
        ("dead_sky", {"camera": {"source": "none"}}, "has no camera"),
        ("moved_star", {}, "rendered pictures only, and camera.source is 'fixes'"),
        ("hidden_discs", {}, "no section 'overhead'"),
        ("hidden_body", {}, "no section 'motion_capture'"),
        ("other_imu", {"imu": {"frame_version": 1}}, "reports no serial number"),
    ],
)
def test_a_failure_that_finds_nothing_to_befall_is_refused(kind, vehicle, reason):
    row = {"kind": kind, "vehicle": "alpha"}
    with pytest.raises(ValidationError, match=f"failure '{kind}' of 'alpha' cannot happen: .*{reason}"):
        EmulatedLaboratory({"vehicles": [{"name": "alpha", **vehicle}], "failures": [row]})


def test_a_failure_that_ends_before_it_starts_is_refused():
    with pytest.raises(ValidationError, match="ends"):
        FailureConfig(kind="dead_sky", vehicle="alpha", start_s=5.0, end_s=4.0)


@pytest.mark.parametrize(
    ("kind", "parameters", "complaint"),
    [
        ("leaking_valve", {"valve": 1.5}, "valve .* must be a whole number, got 1.5"),
        ("leaking_valve", {"fraction": math.nan}, "fraction .* must lie in 0..1, got nan"),
        ("leaking_valve", {"fraction": 1.2}, "fraction .* must lie in 0..1, got 1.2"),
        ("bit_flips", {"probability_per_bit": -0.1}, "probability_per_bit .* must lie in 0..1"),
        ("dead_star", {"star": -1}, r"star .* must lie in 0\.\.99999"),
        ("new_star", {"x_m": math.inf}, "x_m .* must lie in"),
        ("stuck_gyro", {"code": 5000}, r"code .* must lie in 0\.\.4095"),
        ("false_lights", {"count": 2.5}, "count .* whole number"),
    ],
)
def test_an_impossible_value_is_refused(kind, parameters, complaint):
    with pytest.raises(ValidationError, match=complaint):
        FailureConfig(kind=kind, vehicle="alpha", parameters=parameters)


def test_an_end_that_is_no_number_is_refused():
    with pytest.raises(ValidationError, match="ends"):
        FailureConfig(kind="dead_sky", vehicle="alpha", end_s=math.nan)


def test_the_older_name_of_the_key_is_still_read():
    row = {"kind": "dead_sky", "vehicle": "alpha", "start_s": 0.5}
    arrivals = EmulatedLaboratory({"vehicles": [{"name": "alpha"}], "faults": [row]}).advance(S)
    assert [a.stamp_ns for a in arrivals if a.channel == "laboratory"] == [S // 2]


def test_failures_of_a_vehicle_are_filled_in_and_its_own():
    rows = [
        FailureConfig(kind="dead_sky", vehicle="alpha", start_s=1.0, end_s=2.0),
        FailureConfig(kind="leaking_valve", vehicle="alpha", start_s=3.0),
        FailureConfig(kind="leaking_valve", vehicle="beta", start_s=4.0),
    ]
    failures = Failures.of_vehicle(rows, "alpha")
    assert [(f.kind, f.start_ns, f.end_ns) for f in failures.all()] == [
        ("dead_sky", S, 2 * S),
        ("leaking_valve", 3 * S, None),
    ]
    assert failures.active("dead_sky", 2 * S) is None
    assert failures.active("leaking_valve", 4 * S).parameters == {"valve": 0.0, "fraction": 0.1}


def test_only_those_who_watch_a_device_learn_of_its_failures():
    failures = Failures()
    calls = []
    failures.watch("valves", calls.append)
    failures.report("camera", 1)
    failures.report("valves", 2)
    assert calls == [2]


def test_failures_that_ended_long_ago_are_forgotten():
    failures = Failures()
    for minute in range(100):
        start_ns = minute * 60 * S
        failures.add(Failure("dead_sky", start_ns, start_ns + S, {}))
    assert len(failures.all()) == 2
    assert failures.active("dead_sky", 99 * 60 * S)
