"""A rest counts by good samples only, so nothing takes off that has not rested."""

import pytest

from groundstation.parts.fusion.messages import FusionStatus
from groundstation.parts.valves.messages import ValveStatus


def fault(kind, start_s, end_s, **parameters):
    inner = ", ".join(f"{name} = {float(value)}" for name, value in parameters.items())
    return (
        f'\n[[laboratory.faults]]\nkind = "{kind}"\nvehicle = "alpha"\n'
        f"start_s = {start_s}\nend_s = {end_s}\nparameters = {{ {inner} }}\n"
    )


def rests(flight, **span):
    return [status.rest_s for status in flight.of(FusionStatus, **span)]


def floats(flight, **span):
    return any(status.floating for status in flight.of(ValveStatus, **span))


def test_a_rest_takes_as_long_as_the_rig_says(fly):
    flight = fly("\n[mock_ups.standard.fusion]\nrest_s = 4.0\n", short_rest=False).run(6.0)
    taken_off_s = next(
        now_ns * 1e-9
        for status, now_ns in zip(flight.published[ValveStatus], flight.stamps_ns[ValveStatus], strict=True)
        if status.floating
    )
    assert 4.0 < taken_off_s < 4.5  # asked for at the next status
    kept = rests(flight, start_s=taken_off_s + 0.1)
    assert 4.0 <= kept[0] < 4.5
    assert set(kept) == set(kept[:1])


def test_a_dead_block_keeps_the_vehicle_landed(fly):
    flight = fly(fault("lost_bytes", 0.0, 60.0, probability_per_byte=1.0)).run(6.0)
    assert set(rests(flight)) == {0.0}
    assert not floats(flight)


def test_a_gyro_stuck_from_the_start_keeps_the_vehicle_landed(fly):
    flight = fly(fault("stuck_gyro", 0.0, 60.0)).run(6.0)
    assert set(rests(flight, start_s=1.2)) == {0.0}
    assert not floats(flight)


@pytest.mark.parametrize(
    ("kind", "parameters"), [("lost_bytes", {"probability_per_byte": 1.0}), ("stuck_gyro", {})]
)
def test_a_rest_that_is_broken_begins_anew(fly, kind, parameters):
    long_rest = "\n[mock_ups.standard.fusion]\nrest_s = 4.0\n"
    flight = fly(long_rest + fault(kind, 2.0, 3.0, **parameters), short_rest=False).run(6.9)
    before, broken = rests(flight, start_s=1.8, stop_s=2.0), rests(flight, start_s=2.8, stop_s=3.0)
    assert before[0] > 1.5
    assert broken == [0.0]
    assert not floats(flight)
    flight.request("fly")  # a gyro that stuck is for a person to clear
    flight.run(2.0)
    assert floats(flight, start_s=6.9)
