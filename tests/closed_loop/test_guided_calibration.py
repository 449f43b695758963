"""The guided calibration leads itself through rest, turns and pushes on the emulator, in virtual time."""

import pytest

from calibration import wizards
from groundstation.declarations.request import Request

LONGEST_S = 400
SCALE_ERROR = 0.012
CHANGES = (
    ('model = "published"', f'model = "published"\ngyro_scale_error = {SCALE_ERROR}'),
    ("rate_hz = 1.5", "rate_hz = 5.0"),
    ("delay_s = 0.6", "delay_s = 0.1"),
    ("bus_index = 0", "bus_index = 0\nstarts_by_itself = false"),
)


@pytest.mark.slow
def test_the_sequence_ends_with_enough_data_and_the_emulators_constants(fly):
    guide = wizards.load_wizard("imu").begin(fly(changes=CHANGES).rig, "alpha")
    advice = []
    node = wizards.GuideNode("alpha", guide, advice.append, "test")
    flight = fly(changes=CHANGES, extra_nodes=[node])
    while not node.is_done and flight.runner.now_ns < LONGEST_S * 1e9:
        flight.run(1.0)
    assert not node.trouble
    assert {request.author for request in flight.of(Request)} == {"test"}
    assert advice[-1].step is None
    assert set(guide.outcomes.values()) == {"enough data"}, guide.outcomes
    found = guide.outcome().quantities
    true = {"gyro_scale": 1.0 - 1.0 / (1.0 + SCALE_ERROR), "lever_x": 0.03151, "lever_y": -0.02122}
    for name, value in true.items():
        assert abs(found[name].value - value) < 4.0 * found[name].sigma, name
    assert found["gyro_scale"].sigma < 2e-3
