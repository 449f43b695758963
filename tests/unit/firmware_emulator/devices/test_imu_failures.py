"""What fails about an IMU block, seen in its frames and replies."""

import numpy as np
import pytest

from drivers.imu_block.protocol import FrameParser, Identity, ImuFrame, Pong, encode_identify, encode_ping
from firmware_emulator.laboratory import EmulatedLaboratory

MS = 1_000_000
S = 1_000_000_000
START_S, END_S = 1.0, 2.0


def frames_and_replies(kind=None, version=2, asked_at_s=(), **parameters):
    """All that a block reports in three seconds, with its arrival in s, and the failure from 1 to 2 s."""
    imu = {"ftdi_latency_ms": 1, "serial_number": 7, "frame_version": version, "clock_ppm": 0.0}
    vehicle = {"name": "alpha", "imu": imu, "camera": {"source": "none"}}
    row = {"kind": kind, "vehicle": "alpha", "start_s": START_S, "end_s": END_S, "parameters": parameters}
    laboratory = EmulatedLaboratory({"vehicles": [vehicle], "failures": [row] if kind else []}, seed=4)
    parser = FrameParser(version)
    reported = []
    for until_s in (*asked_at_s, 3.0):
        for arrival in laboratory.advance(round(until_s * S)):
            if arrival.channel == "alpha/imu":
                reported += [(arrival.stamp_ns / S, item) for item in parser.feed(arrival.data)]
        laboratory.deliver(round(until_s * S), "alpha/imu", encode_identify(1) + encode_ping(2))
    return reported


def frames(reported, start_s=0.0, end_s=9.0):
    return [item for at_s, item in reported if isinstance(item, ImuFrame) and start_s <= at_s < end_s]


def test_a_shifted_block_is_off_by_what_the_failure_states_and_no_longer():
    ill = frames_and_replies("shifted_imu", gyro_deg_s=-10.0, acc_x_mg=20.0, acc_y_mg=-40.0)
    healthy = frames_and_replies()

    def off(start_s, end_s):
        """Mean of each frame's gyro and differences against the healthy block's, which has the same noise."""
        values = [
            [(f.gyro_counts, *f.tilt_difference_counts) for f in frames(rows, start_s, end_s)]
            for rows in (ill, healthy)
        ]
        return np.mean(np.subtract(*values), axis=0)

    assert off(0.0, START_S) == pytest.approx(0.0, abs=1e-12)
    # 4.1 counts per deg/s, 6554 per g; the codes are whole
    assert off(1.02, END_S) == pytest.approx((-41.0, 0.02 * 6554, -0.04 * 6554), abs=0.3)
    assert off(2.02, 3.0) == pytest.approx(0.0, abs=1e-12)


def test_a_silent_block_sends_neither_frames_nor_replies_until_it_speaks_again():
    reported = frames_and_replies("silent_imu", asked_at_s=(1.5, 2.5))
    assert not [item for at_s, item in reported if START_S + 0.01 < at_s < END_S]
    assert len(frames(reported, 0.5, START_S)) == 50
    assert len(frames(reported, END_S + 0.01, 3.0)) == pytest.approx(99, abs=1)
    assert [type(item) for _, item in reported if not isinstance(item, ImuFrame)] == [Identity, Pong]


def test_another_block_reports_its_own_serial_number():
    reported = frames_and_replies("other_imu", asked_at_s=(0.5, 1.5, 2.5), serial_number=99)
    assert [item.serial_number for _, item in reported if isinstance(item, Identity)] == [7, 99, 7]


@pytest.mark.parametrize("jump_ms", [500, -700, 32767])
def test_the_tick_jumps_by_what_the_failure_states_and_back(jump_ms):
    ill = frames_and_replies("clock_jump", asked_at_s=(1.5,), jump_ms=jump_ms)
    healthy = frames_and_replies(asked_at_s=(1.5,))
    jumps = [(a.tick_ms - b.tick_ms) % 65536 for a, b in zip(frames(ill), frames(healthy), strict=True)]
    assert jumps.count(jump_ms % 65536) == 100
    assert jumps[0] == jumps[-1] == 0
    pong, same = (next(i for _, i in rows if isinstance(i, Pong)) for rows in (ill, healthy))
    assert (pong.tick_ms - same.tick_ms) % 65536 == jump_ms % 65536


def test_a_block_without_ticks_jumps_in_its_count_of_frames():
    ill = frames_and_replies("clock_jump", version=1, jump_ms=150)
    healthy = frames_and_replies(version=1)
    before = len(frames(healthy, 0.0, START_S))
    first = {f.sequence for f in frames(ill, 1.1, 1.2)}
    same = {(f.sequence + 15) % 256 for f in frames(healthy, 1.1, 1.2)}
    assert before > 90
    assert first == same
