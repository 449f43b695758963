"""The IMU reader on an emulated block: what it makes of its clock, its timer and its attention."""

import math

import pytest

from drivers.imu_block.protocol import SelfTestChannel, encode_self_test
from firmware_emulator.laboratory import EmulatedLaboratory
from groundstation.parts.imu.imu_reader import ImuReader
from groundstation.parts.imu.messages import Imu, ImuBytes
from groundstation.parts.operation.messages import Diagnostics

S = 1_000_000_000


def read(reader, until_s, commands=(), timer_s=math.nan, **imu):
    """Everything that the reader publishes, with a tick twice a second; commands are pairs (s, bytes)."""
    vehicle = {"name": "alpha", "imu": imu, "camera": {"source": "none"}}
    laboratory = EmulatedLaboratory({"vehicles": [vehicle]}, seed=7)
    published, due = [], dict(commands)
    for half in range(1, 2 * until_s + 1):
        for at_s in [at_s for at_s in due if at_s < half / 2]:
            laboratory.advance(round(at_s * S))
            laboratory.deliver(round(at_s * S), "alpha/imu", due.pop(at_s))
        for arrival in laboratory.advance(half * S // 2):
            if arrival.channel == "alpha/imu":
                message = ImuBytes(arrival.stamp_ns, "alpha", arrival.data, timer_s)
                published += reader.receive(message, arrival.stamp_ns)
        published += reader.tick(half * S // 2)
    return published


def a_reader(version="v2", latency_s=0.016, averaging=10):
    return ImuReader("alpha", version, 250_000, latency_s, averaging, None)


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize(
    ("ppm", "words"),
    [(5000.0, "0.50 % fast"), (-5000.0, "0.50 % slow"), (1000.0, "0.10 % fast"), (50.0, ""), (-50.0, "")],
)
def test_a_strange_clock_is_named(version, ppm, words):
    reader = a_reader(f"v{version}")
    published = read(reader, 12, timer_s=0.001, frame_version=version, clock_ppm=ppm, ftdi_latency_ms=1)
    last = [message for message in published if isinstance(message, Diagnostics)][-1]
    assert (words in last.summary) if words else (last.summary == "")
    assert last.level == (1 if words else 0)


@pytest.mark.parametrize("timer_ms", [1, 4, 8, 16])
@pytest.mark.parametrize("averaging", [4, 8, 10])
def test_the_timer_that_the_driver_reports_counts_and_not_the_rig(timer_ms, averaging):
    wrong_s = 0.001 if timer_ms > 4 else 0.016
    imu = {"ftdi_latency_ms": timer_ms, "averaging": averaging, "clock_ppm": 0.0}
    reader = a_reader(latency_s=wrong_s, averaging=averaging)
    published = read(reader, 8, timer_s=timer_ms * 1e-3, **imu)
    vehicle = {"name": "alpha", "imu": imu, "camera": {"source": "none"}}
    grid = EmulatedLaboratory({"vehicles": [vehicle]}, seed=7).mock_ups[0].grid
    samples = [message for message in published if isinstance(message, Imu)]
    for sample in samples:
        error_s = (sample.stamp_ns - grid.stamp_ns(sample.tick_ms)) * 1e-9
        assert abs(error_s) < 3.0 * sample.stamp_sigma_s
    assert abs(error_s) < 0.0003


@pytest.mark.parametrize("averaging", [4, 10, 40])
def test_no_sample_of_a_self_test_is_believed(averaging):
    command = encode_self_test(1, SelfTestChannel.GYRO_NEGATIVE, 300)
    reader = a_reader(averaging=averaging)
    published = read(reader, 4, [(2.01, command)], averaging=averaging, ftdi_latency_ms=1)
    samples = [message for message in published if isinstance(message, Imu)]
    believed = [sample for sample in samples if sample.usable & 1 and sample.valid]
    turned_rad = sum(sample.rate_body_rad_s * sample.window_s for sample in believed)
    assert abs(turned_rad) < math.radians(8.0)
    assert max(abs(sample.rate_body_rad_s) for sample in believed) < math.radians(10.0)
    assert any(not sample.valid for sample in samples)
    assert samples[-1].valid
