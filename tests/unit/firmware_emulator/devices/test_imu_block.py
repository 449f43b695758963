from itertools import pairwise

import pytest

from drivers.imu_block.packet import seal
from drivers.imu_block.protocol import (
    Ack,
    FrameParser,
    HousekeepingItem,
    Identity,
    ImuFrame,
    Pong,
    SelfTestChannel,
    Status,
    encode_identify,
    encode_ping,
    encode_reset,
    encode_self_test,
    encode_set_averaging,
)
from firmware_emulator.laboratory import EmulatedLaboratory

MS = 1_000_000
S = 1_000_000_000
DONE, BAD_ARGUMENT = 0, 2


def block(failures=(), **imu):
    vehicle = {"name": "alpha", "imu": {"ftdi_latency_ms": 1, **imu}, "camera": {"source": "none"}}
    rows = [{"vehicle": "alpha", **failure} for failure in failures]
    return EmulatedLaboratory({"vehicles": [vehicle], "failures": rows}, seed=4)


def talk(laboratory, until_ns, commands=(), parser=None):
    """Frames and replies until a stamp, after sending the commands now."""
    parser = parser or FrameParser(2)
    reported = []
    for data in commands:
        laboratory.deliver(laboratory.next_arrival_ns(), "alpha/imu", data)
    for arrival in laboratory.advance(until_ns):
        if arrival.channel == "alpha/imu":
            reported += parser.feed(arrival.data)
    return reported


def only(kind, reported):
    return [item for item in reported if isinstance(item, kind)]


def test_it_starts_with_rubbish_then_the_first_tick():
    laboratory = block()
    chunks = [a.data for a in laboratory.advance(500 * MS) if a.channel == "alpha/imu"]
    assert chunks[0] == b"\xf8"
    first = only(ImuFrame, FrameParser(2).feed(b"".join(chunks)))[0]
    assert (first.tick_ms, first.sample_count) == (10, 10)


def test_a_frame_leaves_half_a_millisecond_after_its_tick_and_takes_its_bytes_time():
    laboratory = block(clock_ppm=0.0, host_jitter_s=0.0, averaging=10)
    stamps = [a.stamp_ns for a in laboratory.advance(S) if a.channel == "alpha/imu"][1:]
    edge_ns = laboratory.mock_ups[0].grid.stamp_ns(10)
    assert stamps[0] == edge_ns + 500_000 + 40_000 + MS  # first byte, then the timer; 21 bytes take 0.84 ms
    assert {b - a for a, b in pairwise(stamps)} == {10 * MS}


def test_a_fast_crystal_gains_on_the_host():
    laboratory = block(clock_ppm=100.0, host_jitter_s=0.0)
    stamps = [a.stamp_ns for a in laboratory.advance(20 * S) if a.channel == "alpha/imu"][1:]
    assert (stamps[-1] - stamps[0]) / (len(stamps) - 1) == pytest.approx(10 * MS / 1.0001, rel=1e-6)


def test_it_answers_ping_and_identify():
    laboratory = block(serial_number=77)
    talk(laboratory, S)
    reported = talk(laboratory, S + 50 * MS, [encode_ping(1), encode_identify(2)])
    (pong,), (identity,) = only(Pong, reported), only(Identity, reported)
    assert pong.tag == 1
    assert pong.tick_ms == pytest.approx(965, abs=3)
    assert (identity.tag, identity.serial_number, identity.sample_count) == (2, 77, 10)


def test_averaging_changes_with_the_next_window_and_no_poll_is_lost():
    laboratory = block()
    parser = FrameParser(2)
    before = talk(laboratory, S, parser=parser)
    after = talk(laboratory, S + 500 * MS, [encode_set_averaging(3, 4)], parser)
    assert only(Ack, after) == [Ack(3, 0x42, DONE)]
    frames = only(ImuFrame, before + after)
    assert frames[-1].sample_count == 4
    steps = [b.tick_ms - a.tick_ms for a, b in pairwise(frames)]
    assert steps == [frame.sample_count for frame in frames[1:]]


def test_an_averaging_that_the_line_cannot_carry_is_refused_and_counted():
    laboratory = block(baud=115200)
    talk(laboratory, S)
    reported = talk(laboratory, S + 200 * MS, [encode_set_averaging(3, 1)])
    assert only(Ack, reported) == [Ack(3, 0x42, BAD_ARGUMENT)]
    frames = only(ImuFrame, reported)
    assert {frame.sample_count for frame in frames} == {10}
    status = [f.housekeeping.value for f in frames if f.housekeeping.item is HousekeepingItem.STATUS][-1]
    assert status >> 8 == 1


def test_a_self_test_deflects_for_its_time_and_says_so():
    laboratory = block()
    talk(laboratory, S)
    command = encode_self_test(5, SelfTestChannel.GYRO_POSITIVE | SelfTestChannel.TILT_Y_X, 200)
    frames = only(ImuFrame, talk(laboratory, 2 * S, [command]))
    tested = [frame for frame in frames if frame.attention]
    assert len(tested) == pytest.approx(20, abs=1)
    assert tested[5].gyro_counts - frames[-1].gyro_counts == pytest.approx(221, abs=2)
    assert tested[5].tilt_counts[2] > 1800
    assert tested[5].tilt_counts[0] < 1100
    assert not frames[-1].attention


def test_a_reset_starts_all_over_with_the_watchdog_bit():
    laboratory = block()
    parser = FrameParser(2)
    talk(laboratory, S, [encode_set_averaging(1, 20)], parser)
    reported = talk(laboratory, 2 * S, [encode_reset(9)], parser)
    assert only(Ack, reported)[-1] == Ack(9, 0x44, DONE)
    frames = only(ImuFrame, reported)
    restarted = next(index for index, frame in enumerate(frames) if frame.tick_ms == 10)
    assert [frame.tick_ms for frame in frames[restarted : restarted + 3]] == [10, 20, 30]
    statuses = [f.housekeeping.value for f in frames[restarted:] if f.housekeeping.item == 3]
    assert Status.RESET_WATCHDOG in Status(statuses[0] & 0xFF)


def test_a_version_1_block_hears_nothing():
    laboratory = block(frame_version=1, averaging=8)
    talk(laboratory, S, parser=FrameParser(1))
    laboratory.deliver(S, "alpha/imu", encode_reset(1))
    frames = talk(laboratory, 2 * S, parser=FrameParser(1))
    steps = {(b.sequence - a.sequence) & 0xFF for a, b in pairwise(frames)}
    assert steps == {1}


def test_housekeeping_tells_the_three_temperatures_and_their_warming():
    laboratory = block(ambient_c=20.0, warm_up_k=8.0, warm_up_s=20.0)
    frames = only(ImuFrame, talk(laboratory, 60 * S))
    codes = {item: [f.housekeeping.value for f in frames if f.housekeeping.item == item] for item in range(4)}
    gyro_c = [25.0 + (code - 2048) * 0.1453 for code in codes[0]]
    assert gyro_c[0] == pytest.approx(20.0, abs=0.7)
    assert gyro_c[-1] == pytest.approx(27.6, abs=0.7)
    assert (codes[1][-1] - 197) / -1.083 == pytest.approx(27.6, abs=0.6)


def test_a_dead_chip_shows_in_codes_and_status():
    laboratory = block([{"kind": "dead_tilt", "start_s": 0.5, "parameters": {"axis": 1}}])
    frames = only(ImuFrame, talk(laboratory, S))
    assert frames[-1].tilt_counts[2:] == (2047.0, 2047.0)
    assert frames[-1].attention
    assert not frames[10].attention


def test_noise_on_the_receive_side_disturbs_nothing():
    laboratory = block()
    talk(laboratory, S)
    reported = talk(laboratory, S + 100 * MS, [bytes(range(256)), encode_ping(8)])
    assert [pong.tag for pong in only(Pong, reported)] == [8]


@pytest.mark.parametrize(("baud", "least"), [(115200, 2), (250000, 1)])
def test_the_smallest_averaging_is_what_the_line_carries(baud, least):
    laboratory = block(baud=baud)
    parser = FrameParser(2)
    talk(laboratory, S, parser=parser)
    reported = talk(laboratory, 2 * S, [encode_set_averaging(3, least)], parser)
    assert only(Ack, reported) == [Ack(3, 0x42, DONE)]
    assert only(ImuFrame, reported)[-1].sample_count == least
    assert parser.counters.frames_lost == 0


@pytest.mark.parametrize("content", ["4001", "400102ff", "4203", "42030405", "4304", "44055254ff", "440552"])
def test_a_known_command_of_a_wrong_length_is_a_bad_argument_and_one_without_a_tag_nothing(content):
    laboratory = block()
    talk(laboratory, S)
    packet = bytes.fromhex(content)
    expected = [] if content == "4001" else [Ack(packet[1], packet[0], BAD_ARGUMENT)]
    if content == "4001":
        packet = packet[:1]
    assert only(Ack, talk(laboratory, S + 100 * MS, [seal(packet)])) == expected
