"""The guided calibration leads itself through rest, turns and pushes on the emulator, in virtual time."""

import pytest

from calibration.imu.guided import GuidedSequence
from groundstation.bus.envelope import Delivered, Envelope
from groundstation.cli import calibrate_guided
from groundstation.cli.calibrate_flight import constants, widened
from groundstation.declarations.request import Ack, Request
from groundstation.fusion.offline import OfflineSmoother
from groundstation.parts.fusion.estimation import fix_floors_of, rig_noise
from groundstation.parts.fusion.fusion import Fusion
from groundstation.parts.imu.messages import Imu
from groundstation.parts.stars.messages import StarFix
from groundstation.parts.valves.messages import ValveStatus

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

    def ask(_endpoint, vehicle, action, argument, author, _timeout_s):
        number, now_ns = next(numbers), flight.runner.now_ns
        request = Request(now_ns, vehicle, number, author, action, argument)
        envelope = Envelope(Request.TOPIC, author, number, now_ns)
        flight.runner._publish([Delivered(envelope, request)])
        return Ack(now_ns, vehicle, number, author, action, True, "")

    clock_ns = [0]
    monkeypatch.setattr(calibrate_guided, "ask", ask)
    monkeypatch.setattr(calibrate_guided, "monotonic_ns", lambda: clock_ns[0])
    smoother = OfflineSmoother(widened(rig_noise(flight.rig, "alpha")))
    node = Fusion("alpha", smoother, "filter", fix_floors_of(flight.rig, "alpha"))
    watch = calibrate_guided._Watch(node, smoother)
    driver = calibrate_guided._Driver("", "alpha")
    sequence = GuidedSequence()
    for second in range(LONGEST_S):
        flight.run(1.0)
        said = sorted(
            (payload for kind in (Imu, StarFix, ValveStatus) for payload in flight.published[kind]),
            key=lambda payload: payload.stamp_ns,
        )
        for payload in said:
            topic = payload.TOPIC
            clock_ns[0] = payload.stamp_ns
            watch.hear(f"alpha/{topic.noun}", topic.codec.encode(payload), b"")
            watch.work(0.0)
        for kind in (Imu, StarFix, ValveStatus):
            flight.published[kind].clear()
        advice = sequence.update(float(second), watch.known())
        if advice.step is None:
            break
        driver.act(advice.step.name, is_rest=advice.step.is_rest, pose=watch.pose(), now_s=float(second))
    assert set(sequence.outcomes.values()) == {"enough data"}, sequence.outcomes
    found = constants(smoother)
    true = {"gyro_scale": 1.0 - 1.0 / (1.0 + SCALE_ERROR), "lever_x": 0.03151, "lever_y": -0.02122}
    for name, value in true.items():
        assert abs(found[name].value - value) < 4.0 * found[name].std, name
    assert found["gyro_scale"].std < 2e-3
