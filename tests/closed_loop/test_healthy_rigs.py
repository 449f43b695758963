"""Every example rig, and every link of an IMU block, flown without a failure: nothing is found."""

from pathlib import Path

import pytest

from groundstation.parts.supervision.messages import Faults

FOLDER = Path(__file__).parents[2] / "examples" / "rigs"
RIGS = sorted(path.stem for path in FOLDER.glob("*.toml"))
FLY_S = 40.0
TRUE = {"motion_capture": {"star_outage"}}
"""What really happens there: a body that is hidden for longer than half a second has no fixes."""


def found(flight):
    """Faults of all vehicles, by their names."""
    vehicles = flight.rig.vehicles
    return {
        (name, fault, detail)
        for name in vehicles
        for row in flight.of(Faults, name)
        for fault, detail in zip(row.ids, row.details, strict=True)
    }


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
@pytest.mark.parametrize("rig", RIGS)
def test_a_healthy_rig_has_no_faults(fly, rig, seed):
    flight = fly(rig=rig, seed=seed, short_rest=False).run(FLY_S)
    expected = TRUE.get(rig, set())
    assert {row for row in found(flight) if row[1] not in expected} == set()


@pytest.mark.parametrize("averaging", [4, 10])
@pytest.mark.parametrize(
    ("stated", "true_ms"),
    [("ftdi_latency_s = 0.016\n", 16), ("ftdi_latency_s = 0.016\n", 1), ("ftdi_latency_s = 0.001\n", 16)],
    ids=["16 ms", "1 ms, 16 stated", "16 ms, 1 stated"],
)
def test_the_timer_of_an_adapter_is_no_fault_of_the_vehicle(fly, averaging, stated, true_ms):
    """A timer that is another than stated shifts the samples' stamps; no valve and no sensor is accused."""
    changes = [("ftdi_latency_s = 0.001\n", stated)]
    text = (FOLDER / "two_mock_ups_drawn.toml").read_text()
    for name in ("alpha", "beta"):
        start = text.index(f'name = "{name}"\nstart_m')
        line = text[start : text.index("camera", start)]
        other = line.replace(
            "averaging = 10, ftdi_latency_ms = 1", f"averaging = {averaging}, ftdi_latency_ms = {true_ms}"
        )
        changes.append((line, other))
    flight = fly(rig="two_mock_ups_drawn", seed=2, short_rest=False, changes=changes).run(26.0)
    assert found(flight) == set()
