"""The guided calibration leads itself through rest, turns and pushes on the emulator, in virtual time."""

import pytest

from calibration import wizards
from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.topics import topic_of
from groundstation.messages import definitions as m

LONGEST_S = 400
SCALE_ERROR = 0.012


@pytest.mark.slow
def test_the_sequence_ends_with_enough_data_and_the_emulators_constants(fly, monkeypatch):
    flight = fly(
        changes=[
            ('model = "published"', f'model = "published"\ngyro_scale_error = {SCALE_ERROR}'),
            ("rate_hz = 1.5", "rate_hz = 5.0"),
            ("delay_s = 0.6", "delay_s = 0.1"),
        ]
    ).run(4.0)
    numbers = iter(range(1, 1000))

    def ask(action, argument):
        number, now_ns = next(numbers), flight.runner.now_ns
        request = m.Request(now_ns, "alpha", number, "test", action, argument)
        flight.runner._publish([Delivered(Envelope(topic_of(m.Request), "test", number, now_ns), request)])

    clock_ns = [0]
    monkeypatch.setattr(wizards, "monotonic_ns", lambda: clock_ns[0])
    guide = wizards.load_wizard("imu").begin(flight.rig, "alpha")
    inbox = wizards._Inbox(guide)
    for second in range(LONGEST_S):
        flight.run(1.0)
        said = sorted(
            (payload for kind in (m.Imu, m.StarFix, m.ValveStatus) for payload in flight.said[kind]),
            key=lambda payload: payload.stamp_ns,
        )
        for payload in said:
            topic = topic_of(type(payload))
            clock_ns[0] = payload.stamp_ns
            inbox.put(f"alpha/{topic.noun}", topic.codec.encode(payload), b"")
            inbox.deliver(0.0)
        for kind in (m.Imu, m.StarFix, m.ValveStatus):
            flight.said[kind].clear()
        if guide.advice(float(second)).step is None:
            break
        for action, argument in guide.requests(float(second)):
            ask(action, argument)
    assert set(guide.outcomes.values()) == {"enough data"}, guide.outcomes
    found = guide.outcome().quantities
    true = {"gyro_scale": 1.0 - 1.0 / (1.0 + SCALE_ERROR), "lever_x": 0.03151, "lever_y": -0.02122}
    for name, value in true.items():
        assert abs(found[name].value - value) < 4.0 * found[name].std, name
    assert found["gyro_scale"].std < 2e-3
