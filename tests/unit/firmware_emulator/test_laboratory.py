import math

import pytest
from pydantic import ValidationError

from drivers.imu_block.protocol import FrameParser, Identity, ImuFrame, encode_identify
from drivers.imu_block.sensors import rate_rad_s, specific_force_m_s2
from drivers.laboratory import ChannelKind, Laboratory
from drivers.reference.protocol import PoseParser
from drivers.valve_bus.protocol import (
    Arm,
    FloatAir,
    Heartbeat,
    Stop,
    StopReason,
    TankPressure,
    ValveCommand,
    ValveStatus,
    decode,
    encode,
)
from firmware_emulator.laboratory import EmulatedLaboratory

MS = 1_000_000
S = 1_000_000_000


def scenario(count=1, **changes):
    vehicles = [
        {"name": name, "start_m": [1.0 * index, 0.0], **changes}
        for index, name in enumerate(["alpha", "beta"][:count])
    ]
    return {"vehicles": vehicles}


def run(laboratory, until_ns, step_ns=None):
    """Everything that arrives until a stamp, stepping as a lockstep runner does."""
    arrivals = []
    while (next_ns := laboratory.next_arrival_ns()) <= until_ns:
        arrivals += laboratory.advance(next_ns if step_ns is None else next_ns + step_ns)
    return arrivals


def stream(arrivals, channel):
    return [arrival.data for arrival in arrivals if arrival.channel == channel]


def frames(arrivals, channel="alpha/imu", version=2):
    parser = FrameParser(version)
    return [
        item
        for chunk in stream(arrivals, channel)
        for item in parser.feed(chunk)
        if isinstance(item, ImuFrame)
    ]


def poses(arrivals, channel="alpha/reference"):
    parser = PoseParser()
    return [pose for chunk in stream(arrivals, channel) for pose in parser.feed(chunk)]


def commanded_flight(laboratory, seconds=3.0):
    """Arms, floats and fires pairs, in the rhythm of a guard."""
    arrivals = []
    for message in (Arm(0, True), FloatAir(0, True)):
        laboratory.deliver(0, "valve_bus", encode(message))
    for tick in range(1, round(seconds * 50)):
        arrivals += laboratory.advance(tick * 20 * MS)
        on_times = (60, 60, 0, 0, 0, 0, 0, 0) if tick % 10 == 0 else (0,) * 8
        pulse = (tick // 10 + (tick % 10 > 4)) & 0xF if tick % 10 == 0 else (tick // 10) & 0xF
        command = ValveCommand(0, tick & 0xF, pulse, on_times)
        laboratory.deliver(tick * 20 * MS, "valve_bus", encode(command))
    return arrivals


def comparable(arrivals):
    return [(arrival.stamp_ns, arrival.channel, repr(arrival.data)) for arrival in arrivals]


def test_it_is_a_laboratory_with_documented_channels():
    laboratory = EmulatedLaboratory(scenario(2), seed=1)
    assert isinstance(laboratory, Laboratory)
    assert laboratory.channels() == {
        "laboratory": ChannelKind.FAILURES,
        "valve_bus": ChannelKind.CAN,
        **{
            f"{name}/{device}": ChannelKind.BYTES
            for name in ("alpha", "beta")
            for device in ("imu", "fixes", "reference")
        },
    }


def test_the_same_seed_gives_the_same_bytes_and_another_does_not():
    one, same, other = (
        comparable(commanded_flight(EmulatedLaboratory(scenario(), seed=seed))) for seed in (7, 7, 8)
    )
    assert one == same
    assert one != other


def test_arrivals_do_not_depend_on_how_the_runner_steps():
    fine = comparable(run(EmulatedLaboratory(scenario(2), seed=3), 2 * S))
    coarse = comparable(EmulatedLaboratory(scenario(2), seed=3).advance(2 * S))
    assert fine == coarse[: len(fine)]
    assert len(coarse) - len(fine) < 2


def test_the_next_arrival_is_never_announced_too_late():
    laboratory = EmulatedLaboratory(scenario(2, imu={"averaging": 3, "ftdi_latency_ms": 4}), seed=3)
    stamps = []
    while (next_ns := laboratory.next_arrival_ns()) < S:
        stamps += [arrival.stamp_ns for arrival in laboratory.advance(next_ns)]
        assert not stamps or stamps[-1] <= next_ns
    assert stamps == sorted(stamps)
    assert [a.stamp_ns for a in EmulatedLaboratory(scenario(2, imu={"averaging": 3, "ftdi_latency_ms": 4}),
                                                   seed=3).advance(stamps[-1])] == stamps  # fmt: skip


def test_every_frame_of_the_imu_arrives_in_order_at_its_rate():
    got = frames(run(EmulatedLaboratory(scenario(), seed=2), 5 * S))
    ticks = [frame.tick_ms for frame in got]
    assert ticks == list(range(10, 10 * len(ticks) + 1, 10))
    assert len(ticks) == pytest.approx(495, abs=3)


def test_version_1_frames_count_from_one():
    imu = {"frame_version": 1, "baud": 115200, "averaging": 8}
    got = frames(run(EmulatedLaboratory(scenario(imu=imu), seed=2), 2 * S), version=1)
    assert [frame.sequence for frame in got] == [index & 0xFF for index in range(1, len(got) + 1)]
    assert len(got) == pytest.approx(245, abs=4)


def test_a_pulse_on_the_bus_becomes_speed_on_the_table():
    """A pair of 0.22 N for 100 ms less opening plus closing delay, sagging to 0.97, on 11 kg."""
    valves = {"spread": 0.0, "open_delay_sd_s": 0.0}
    table = {"waviness_rad": 0.0}
    config = {**scenario(floating=True, valves=valves, drag_n_s_m=0.0), "table": table}
    laboratory = EmulatedLaboratory(config, seed=1)
    laboratory.deliver(0, "valve_bus", encode(Arm(0, True)))
    on_times = (100, 100, 0, 0, 0, 0, 0, 0)
    for tick in range(6):
        laboratory.advance(tick * 20 * MS)
        laboratory.deliver(tick * 20 * MS, "valve_bus", encode(ValveCommand(0, tick, 1, on_times)))
    final = poses(laboratory.advance(S))[-1]
    assert final.velocity_table_m_s[0] == pytest.approx(2 * 0.22 * 0.97 * 0.099 / 11.0, rel=1e-6)
    assert final.velocity_table_m_s[1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("model", ["published", "datasheet"])
def test_what_the_imu_says_integrates_to_what_the_truth_stream_says(model):
    imu = {
        "model": model, "averaging": 5, "clock_ppm": 0.0, "gyro_bias_rad_s": 0.0, "switch_on_sd_rad_s": 0.0,
        "gyro_tempco_rad_s_k": 0.0, "gyro_scale_error": 0.0, "acc_bias_m_s2": [0.0, 0.0],
        "acc_tempco_m_s2_k": [0.0, 0.0], "acc_scale_error": [0.0, 0.0], "position_body_m": [0.0, 0.0],
        "ambient_c": 25.0, "warm_up_k": 0.0, "ftdi_latency_ms": 1,
    }  # fmt: skip
    config = {**scenario(floating=True, imu=imu), "table": {"waviness_rad": 0.0}}
    laboratory = EmulatedLaboratory(config, seed=9)
    laboratory.deliver(0, "valve_bus", encode(Arm(0, True)))
    arrivals = []
    for tick in range(1, 150):
        arrivals += laboratory.advance(tick * 20 * MS)
        on_times = (0, 120, 0, 0, 0, 0, 0, 0) if 20 < tick < 40 else (0,) * 8  # pushes and turns
        command = ValveCommand(0, tick & 15, tick & 15, on_times)
        laboratory.deliver(tick * 20 * MS, "valve_bus", encode(command))
    heading_rad, vx_m_s, vy_m_s = 0.0, 0.0, 0.0
    for frame in frames(arrivals):
        window_s = 1e-3 * frame.sample_count
        turned_rad = rate_rad_s(frame.gyro_counts) * window_s
        fx, fy = (specific_force_m_s2(counts) for counts in frame.tilt_difference_counts)
        middle_rad = heading_rad + turned_rad / 2.0
        vx_m_s += (fx * math.cos(middle_rad) - fy * math.sin(middle_rad)) * window_s
        vy_m_s += (fx * math.sin(middle_rad) + fy * math.cos(middle_rad)) * window_s
        heading_rad += turned_rad
    truth = poses(arrivals)[-1]
    assert truth.heading_rad > math.radians(5.0)
    # The gyro walks 0.17 deg in 3 s (0.1 deg/s/sqrt(Hz)); tilt codes stick by up to 1.5 mm/s^2 when quiet.
    assert heading_rad == pytest.approx(truth.heading_rad, abs=math.radians(0.5))
    assert (vx_m_s, vy_m_s) == pytest.approx(truth.velocity_table_m_s, abs=0.004)


def test_silence_on_the_bus_closes_the_valves_after_100_ms():
    laboratory = EmulatedLaboratory(scenario(floating=True), seed=1)
    laboratory.deliver(0, "valve_bus", encode(Arm(0, True)))
    laboratory.deliver(0, "valve_bus", encode(ValveCommand(0, 1, 1, (127,) * 8)))
    statuses = [decode(frame) for frame in stream(laboratory.advance(300 * MS), "valve_bus")]
    statuses = [status for status in statuses if isinstance(status, ValveStatus)]
    masks = [status.open_mask for status in statuses]
    assert masks[:4] == [0xFF] * 4
    assert masks[6:] == [0] * len(masks[6:])
    assert statuses[-1].is_dead_man_closed


def test_a_node_obeys_nobody_until_it_is_armed_and_stops_at_once():
    laboratory = EmulatedLaboratory(scenario(floating=True), seed=1)
    laboratory.deliver(0, "valve_bus", encode(ValveCommand(0, 1, 1, (100,) * 8)))
    arrivals = list(laboratory.advance(50 * MS))
    laboratory.deliver(50 * MS, "valve_bus", encode(Arm(0, True)))
    laboratory.deliver(50 * MS, "valve_bus", encode(ValveCommand(0, 2, 2, (100,) * 8)))
    arrivals += laboratory.advance(75 * MS)
    laboratory.deliver(75 * MS, "valve_bus", encode(Stop(15, StopReason.OPERATOR)))
    laboratory.deliver(76 * MS, "valve_bus", encode(ValveCommand(0, 3, 3, (100,) * 8)))
    arrivals += laboratory.advance(130 * MS)
    statuses = [decode(frame) for frame in stream(arrivals, "valve_bus")]
    statuses = [status for status in statuses if isinstance(status, ValveStatus)]
    assert [status.open_mask for status in statuses] == [0, 0, 0xFF, 0, 0, 0]
    assert [status.is_stopped for status in statuses] == [False] * 3 + [True] * 3
    assert statuses[-1].rejected_commands == 0  # only a repeated counter is


def test_a_node_tells_its_pressure_and_that_it_lives():
    received = [decode(f) for f in stream(EmulatedLaboratory(scenario(), seed=1).advance(S), "valve_bus")]
    pressures = [message for message in received if isinstance(message, TankPressure)]
    beats = [message for message in received if isinstance(message, Heartbeat)]
    assert len(pressures) == len(beats) == 4
    assert pressures[0].tank_pa == pytest.approx(20e6, rel=0.01)


def test_a_block_says_who_it_is():
    laboratory = EmulatedLaboratory(scenario(2), seed=1)
    laboratory.advance(S)
    laboratory.deliver(S, "beta/imu", encode_identify(9))
    parser = FrameParser(2)
    answers = [
        item
        for chunk in stream(run(laboratory, S + 100 * MS), "beta/imu")
        for item in parser.feed(chunk)
        if isinstance(item, Identity)
    ]
    assert [(answer.tag, answer.serial_number, answer.sample_count) for answer in answers] == [(9, 2, 10)]


def test_drawn_fixes_are_late_and_as_noisy_as_they_say():
    camera = {"rate_hz": 50.0, "delay_s": 0.3}
    arrivals = run(EmulatedLaboratory(scenario(camera=camera), seed=5), 20 * S)
    fixes = poses(arrivals, "alpha/fixes")
    errors = [fix.position_table_m[0] for fix in fixes]
    spread = math.sqrt(sum(error**2 for error in errors) / len(errors))
    assert spread == pytest.approx(0.001, rel=0.1)
    assert fixes[0].covariance_matrix()[0, 0] == pytest.approx(1e-6, rel=1e-5)
    assert {fix.age_ns for fix in fixes} == {300 * MS}


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"vehicles": []}, "vehicles"),
        ({"vehicles": [{"name": "alpha"}], "tabel": {}}, "tabel"),
        ({"vehicles": [{"name": "alpha", "imu": {"averaging": 0}}]}, "vehicles.0.imu.averaging"),
        ({"vehicles": [{"name": "alpha", "mass_kg": -1.0}]}, "vehicles.0.mass_kg"),
        (
            {"vehicles": [{"name": "alpha"}], "failures": [{"kind": "gremlin", "vehicle": "alpha"}]},
            "failures.0",
        ),
        ({"vehicles": [{"name": "alpha", "camera": {"source": "rendered"}}]}, "vehicles.0.camera"),
        (
            {
                "vehicles": [
                    {
                        "name": "alpha",
                        "camera": {"source": "rendered", "ceiling": "c", "camera": "c", "rate_hz": 60.0},
                    }
                ]
            },
            "vehicles.0.camera",
        ),
    ],
)
def test_a_wrong_scenario_names_its_key(change, key):
    with pytest.raises(ValidationError) as raised:
        EmulatedLaboratory(change, seed=0)
    assert ".".join(map(str, raised.value.errors()[0]["loc"])) == key


@pytest.mark.parametrize(
    ("start_m", "complaint"), [([9.0, 0.0], "'beta'.*outside"), ([0.1, 0.0], "'alpha' and 'beta'.*overlap")]
)
def test_vehicles_start_on_the_table_and_apart(start_m, complaint):
    with pytest.raises(ValidationError, match=complaint):
        EmulatedLaboratory({"vehicles": [{"name": "alpha"}, {"name": "beta", "start_m": start_m}]})


def test_nothing_can_be_sent_into_the_past_or_into_nowhere():
    laboratory = EmulatedLaboratory(scenario(), seed=1)
    laboratory.advance(S)
    with pytest.raises(ValueError, match="the laboratory is at"):
        laboratory.deliver(0, "alpha/imu", b"x")
    with pytest.raises(ValueError, match="gamma/imu"):
        laboratory.deliver(S, "gamma/imu", b"x")
