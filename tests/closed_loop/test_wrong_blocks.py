"""An IMU block that is not the one the rig describes is named, and its samples are not believed."""

from pathlib import Path

from groundstation.parts.imu.messages import Imu
from groundstation.parts.operation.messages import Diagnostics
from groundstation.rig.read import parse_rig
from groundstation.runners.make_runner import make_runner

RIGS = Path(__file__).parents[2] / "examples" / "rigs"


def samples_of(text, seconds):
    samples, warnings = [], set()

    def observe(delivered, now_ns):
        if isinstance(delivered.payload, Imu):
            samples.append(delivered.payload)
        elif isinstance(delivered.payload, Diagnostics) and delivered.payload.level:
            warnings.add(delivered.payload.summary)

    runner = make_runner(parse_rig(text, RIGS / "test.toml"), 1, [observe])
    runner.run(round(seconds * 1e9))
    runner.close()
    return samples, warnings


def test_a_block_with_another_serial_number_keeps_the_vehicle_on_the_ground():
    text = (RIGS / "drawn_fixes.toml").read_text()
    text = text.replace("bus_index = 0\n", "bus_index = 0\nimu_serial_number = 77\n")
    samples, warnings = samples_of(text, 12.0)
    late = samples[len(samples) // 4 :]
    assert {sample.reason for sample in late} == {"this is block 1, the rig wants 77"}
    assert not any(sample.valid for sample in late)
    assert "alpha/imu: samples are not believed: this is block 1, the rig wants 77" in warnings


def test_a_legacy_block_that_averages_otherwise_than_the_rig_says_is_named():
    text = (RIGS / "drawn_fixes.toml").read_text()
    station, laboratory = text.split("[laboratory]", 1)
    station = station.replace("baud = 250000", 'baud = 250000\nprotocol = "v1"\naveraging = 25')
    laboratory = laboratory.replace("averaging = 10", "averaging = 10\nframe_version = 1")
    _, warnings = samples_of(station + "[laboratory]" + laboratory, 30.0)
    assert any("averaging = 25" in warning for warning in warnings)


def test_a_block_without_a_thermometer_has_the_temperature_that_the_rig_gives():
    text = (RIGS / "drawn_fixes.toml").read_text()
    station, laboratory = text.split("[laboratory]", 1)
    station = station.replace("baud = 250000", 'baud = 250000\nprotocol = "v1"\ntemperature_c = 21.5')
    laboratory = laboratory.replace("averaging = 10", "averaging = 10\nframe_version = 1")
    samples, _ = samples_of(station + "[laboratory]" + laboratory, 2.0)
    assert {sample.temperature_c for sample in samples} == {21.5}
