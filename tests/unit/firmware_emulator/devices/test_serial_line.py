import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_emulator.devices.serial_line import SerialLine
from firmware_emulator.failures import Failure, Failures

MS = 1_000_000
S = 1_000_000_000


def line(baud=250000, latency_ms=16, jitter_s=0.0, failures=(), seed=0):
    return SerialLine(baud, latency_ms * 1e-3, jitter_s, Failures(failures), np.random.default_rng(seed))


def test_bytes_take_their_time_and_wait_for_the_timer():
    usb = line(latency_ms=1)
    assert usb.send(10 * MS, b"abc") == 10 * MS + 120_000  # 3 x 10 bits at 250 kBd
    assert usb.take(11 * MS) == []
    assert usb.take(12 * MS) == [(10 * MS + 40_000 + MS, b"abc")]


def test_115200_is_really_113636():
    assert line(baud=115200).send(0, b"x" * 1000) == pytest.approx(1000 * 10 / 113636.36 * S, rel=1e-6)


def test_62_bytes_go_at_once():
    usb = line()
    usb.send(0, bytes(100))
    (first, data), (second, rest) = usb.take(S)
    assert (first, len(data)) == (62 * 40_000, 62)
    assert (second, len(rest)) == (63 * 40_000 + 16 * MS, 38)


def test_frames_bunch_behind_a_slow_timer_as_they_do_in_the_laboratory():
    """125 frames/s of 9 bytes through a 16 ms timer: two frames every 16 ms."""
    usb = line(baud=115200)
    for index in range(50):
        usb.send(index * 8 * MS, bytes(9))
    packets = usb.take(S)
    assert sum(len(data) for _, data in packets) == 450
    assert np.mean([len(data) for _, data in packets]) == pytest.approx(18, abs=2)
    assert np.diff([stamp for stamp, _ in packets]).min() >= 16 * MS


@settings(max_examples=60, deadline=None)
@given(
    gaps=st.lists(st.integers(0, 20 * MS), min_size=1, max_size=20),
    sizes=st.lists(st.integers(1, 80), min_size=20, max_size=20),
    latency_ms=st.sampled_from([1, 2, 16]),
)
def test_no_byte_is_lost_reordered_or_early(gaps, sizes, latency_ms):
    usb = line(latency_ms=latency_ms, jitter_s=0.0002)
    sent, now_ns, got, last_ns = b"", 0, b"", 0
    for index, (gap_ns, size) in enumerate(zip(gaps, sizes, strict=False)):
        now_ns += gap_ns
        data = bytes([index]) * size
        usb.send(now_ns, data)
        sent += data
        for stamp_ns, chunk in usb.take(now_ns):
            assert last_ns <= stamp_ns <= now_ns
            assert len(chunk) <= 62
            got, last_ns = got + chunk, stamp_ns
    got += b"".join(chunk for _, chunk in usb.take(now_ns + 10 * S))
    assert got == sent


def test_jitter_has_its_mean():
    usb = line(latency_ms=1, jitter_s=0.0003)
    for index in range(2000):
        usb.send(index * 10 * MS, b"x")
    late = [stamp - index * 10 * MS - 40_000 - MS for index, (stamp, _) in enumerate(usb.take(100 * S))]
    assert np.mean(late) == pytest.approx(0.3 * MS, rel=0.08)
    assert min(late) >= 0


def test_flipped_bits_come_at_their_rate():
    usb = line(failures=[Failure("bit_flips", 0, None, {"probability_per_bit": 0.01})])
    usb.send(0, bytes(20_000))
    flipped = sum(int(byte).bit_count() for _, chunk in usb.take(100 * S) for byte in chunk)
    assert flipped == pytest.approx(1600, rel=0.1)


def test_bytes_get_lost_at_their_rate_and_only_while_the_failure_lasts():
    usb = line(failures=[Failure("lost_bytes", S, 2 * S, {"probability_per_byte": 0.2})])
    for start_ns in (0, S, 2 * S):
        usb.send(start_ns, bytes(5000))
    per_second = [0, 0, 0]
    for stamp_ns, chunk in usb.take(10 * S):
        per_second[min(2, stamp_ns // S)] += len(chunk)
    assert per_second[0] == 5000
    assert per_second[1] == pytest.approx(4000, rel=0.04)
    assert per_second[2] == 5000


def test_half_frames_break_off():
    usb = line(failures=[Failure("half_frames", 0, None, {"probability_per_frame": 1.0})])
    for index in range(100):
        usb.send(index * 50 * MS, bytes(21))
    lengths = [len(chunk) for _, chunk in usb.take(100 * S)]
    assert max(lengths) < 21
    assert np.mean(lengths) == pytest.approx(10.5, abs=1.5)
