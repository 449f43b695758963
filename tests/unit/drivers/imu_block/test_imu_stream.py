"""Frames out of streams that were cut, flipped, shortened, mixed and made of noise."""

import dataclasses
import itertools
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.imu_block import cobs, protocol
from drivers.imu_block.protocol import (
    Ack,
    CommandParser,
    FrameParser,
    Identity,
    ImuFrame,
    Pong,
    encode_reply,
    encode_v1,
    encode_v2,
)
from drivers.imu_block.sensors import Environment

SIXTEENTH = 1 / 16
REPLY_BYTES = (
    encode_reply(Pong(1, 513)) + encode_reply(Ack(3, 0x42, 0)) + encode_reply(Identity(2, 2, 1, 0, 7, 4))
)


def v1(sequence, gyro=2048.0, x=0.0, y=0.0):
    return encode_v1(sequence=sequence, gyro_counts=gyro, tilt_difference_counts=(x, y))


def v2(tick, gyro=2048.0, tilts=(1024, 1020, 1000, 1048), count=1, item=0, value=2048):
    return encode_v2(
        tick_ms=tick, sample_count=count, gyro_counts=gyro, tilt_counts=tilts, housekeeping=(item, value)
    )


def frames_of(results):
    return [result for result in results if isinstance(result, ImuFrame)]


def feed_in_chunks(parser, stream, cuts):
    """Feed ``stream`` cut at ``cuts``; end offsets come back counted from the stream's start."""
    results = []
    edges = [0, *sorted({cut % (len(stream) + 1) for cut in cuts}), len(stream)]
    for begin, end in itertools.pairwise(edges):
        for result in parser.feed(stream[begin:end]):
            if isinstance(result, ImuFrame):
                result = result._replace(end_offset=result.end_offset + begin)
            results.append(result)
    return results


def mixed_stream(seed):
    """Good frames of one or both versions among noise, replies and damage."""
    rng = random.Random(seed)
    parts = []
    for _ in range(rng.randint(1, 5)):
        first = rng.randrange(256)
        kind = rng.randrange(4)
        if kind == 0:
            parts += [v1(first + k, 2048 + rng.uniform(-50, 50)) for k in range(rng.randint(1, 40))]
        elif kind == 1:
            parts += [v2(first + k, 2048 + rng.uniform(-50, 50)) for k in range(rng.randint(1, 40))]
        elif kind == 2:
            parts.append(rng.randbytes(rng.randint(0, 1500)))
        else:
            parts.append(REPLY_BYTES)
    stream = bytearray(b"".join(parts))
    for _ in range(rng.randint(0, 5)):
        if stream:
            stream[rng.randrange(len(stream))] ^= 1 << rng.randrange(8)
    for _ in range(rng.randint(0, 3)):
        if stream:
            del stream[rng.randrange(len(stream))]
    return bytes(stream)


@pytest.mark.parametrize("version", [None, 1, 2])
@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**9), cuts=st.lists(st.integers(0, 10**6), max_size=60))
def test_any_chunking_gives_the_same_frames_and_counts(version, seed, cuts):
    stream = mixed_stream(seed)
    whole, cut = FrameParser(version), FrameParser(version)
    assert feed_in_chunks(cut, stream, cuts) == feed_in_chunks(whole, stream, [])
    assert cut.detected_version == whole.detected_version
    counts = dataclasses.replace(cut.counters, bytes_rejected=whole.counters.bytes_rejected)
    assert counts == whole.counters


@pytest.mark.parametrize("version", [None, 1, 2])
def test_byte_by_byte_gives_the_same_frames(version):
    for seed in range(20):
        stream = mixed_stream(seed)
        whole, single = FrameParser(version), FrameParser(version)
        expected = feed_in_chunks(whole, stream, [])
        assert feed_in_chunks(single, stream, range(len(stream))) == expected


@pytest.mark.parametrize("version", [None, 1, 2])
@settings(max_examples=60, deadline=None)
@given(noise=st.binary(max_size=3000))
def test_noise_never_raises_and_every_byte_is_accounted_for(version, noise):
    parser = FrameParser(version)
    parser.feed(noise)
    assert parser.counters.bytes_seen == len(noise)
    assert parser.counters.bytes_rejected + parser.counters.bytes_undetected <= len(noise)


@pytest.mark.parametrize("make", [v1, v2])
def test_after_noise_the_next_frames_are_found_by_themselves(make):
    rng = random.Random(5)
    for _ in range(20):
        parser = FrameParser()
        assert frames_of(parser.feed(rng.randbytes(2500))) == []
        found = frames_of(parser.feed(b"".join(make(k) for k in range(1, 121))))
        assert len(found) >= 115


@settings(max_examples=100, deadline=None)
@given(
    tick=st.integers(0, 65535),
    count=st.integers(1, 255),
    gyro=st.integers(0, 4095 * 16),
    tilts=st.tuples(*[st.integers(0, 2047 * 16)] * 4),
    item=st.integers(0, 3),
    value=st.integers(0, 65535),
    attention=st.booleans(),
)
def test_a_v2_frame_says_what_was_put_in(tick, count, gyro, tilts, item, value, attention):
    wire = encode_v2(
        tick_ms=tick,
        sample_count=count,
        gyro_counts=gyro * SIXTEENTH,
        tilt_counts=[t * SIXTEENTH for t in tilts],
        housekeeping=(item, value),
        attention=attention,
    )
    assert len(wire) == protocol.V2_WIRE_BYTES <= 22
    assert wire[0] == wire[-1] == 0
    assert 0 not in wire[1:-1]
    (frame,) = FrameParser(2).feed(wire)
    assert (frame.tick_ms, frame.sample_count, frame.attention) == (tick, count, attention)
    assert frame.gyro_counts == gyro * SIXTEENTH
    assert frame.tilt_counts == tuple(t * SIXTEENTH for t in tilts)
    assert frame.tilt_difference_counts == (
        (tilts[0] - tilts[1]) * SIXTEENTH,
        (tilts[2] - tilts[3]) * SIXTEENTH,
    )
    possible = value <= (4095, 255, 255, 65535)[item]
    assert frame.housekeeping == ((item, value) if possible else None)


def test_one_wrong_bit_or_lost_byte_anywhere_costs_at_most_one_v2_frame():
    stream = b"".join(v2(tick) for tick in range(1, 7))
    for position in range(len(stream)):
        damaged = [stream[:position] + stream[position + 1 :]]
        damaged += [
            stream[:position] + bytes([stream[position] ^ 1 << bit]) + stream[position + 1 :]
            for bit in range(8)
        ]
        for wire in damaged:
            ticks = [frame.tick_ms for frame in frames_of(FrameParser(2).feed(wire))]
            assert len(ticks) >= 5
            assert set(ticks) <= set(range(1, 7))


def test_one_wrong_bit_costs_a_locked_v1_stream_one_frame_and_the_lock_holds():
    frames = [v1(k) for k in range(1, 13)]
    before, after = b"".join(frames[:6]), b"".join(frames[7:])
    for bit in range(72):
        broken = bytearray(frames[6])
        broken[bit // 8] ^= 1 << bit % 8
        parser = FrameParser(1)
        sequences = [f.sequence for f in parser.feed(before + bytes(broken) + after)]
        assert sequences == [1, 2, 3, 4, 5, 6, 8, 9, 10, 11, 12]
        assert parser.counters.frames_lost == 1
        assert parser.counters.locks == 1


def test_a_v1_stream_is_believed_only_after_three_frames_in_a_row():
    parser = FrameParser(1)
    assert parser.feed(v1(7) + v1(8)) == []
    held = parser.feed(v1(9))
    assert [frame.sequence for frame in held] == [7, 8, 9]
    assert [frame.end_offset for frame in held] == [-10, -1, 8]
    assert FrameParser(1).feed(v1(7) + v1(8) + v1(10) + v1(11)) == []


def test_a_restarted_v1_block_is_locked_again_without_losing_a_new_frame():
    parser = FrameParser(1)
    parser.feed(b"".join(v1(k) for k in range(100, 110)))
    again = parser.feed(b"\xff" + b"".join(v1(k) for k in range(1, 8)))
    assert [frame.sequence for frame in again] == [1, 2, 3, 4, 5, 6, 7]
    assert parser.counters.locks == 2
    assert parser.counters.discontinuities == 1


def test_v1_chunks_lost_on_the_way_are_counted_and_cost_no_further_frame():
    parser = FrameParser(1)
    got = parser.feed(b"".join(v1(k) for k in range(1, 11)) + b"".join(v1(k) for k in range(31, 41)))
    assert [frame.sequence for frame in got] == [*range(1, 11), *range(31, 41)]
    assert parser.counters.frames_lost == 20


def test_a_gyro_jump_costs_one_v1_frame_and_a_lasting_one_is_followed():
    parser = FrameParser(1)
    stream = b"".join(v1(k) for k in range(1, 6)) + v1(6, 3500) + b"".join(v1(k) for k in range(7, 9))
    assert [f.sequence for f in parser.feed(stream)] == [1, 2, 3, 4, 5, 7, 8]
    assert parser.counters.rejected_step == 1
    lasting = parser.feed(b"".join(v1(k, 3500) for k in range(9, 14)))
    assert [f.sequence for f in lasting] == [10, 11, 12, 13]


def test_values_no_sensor_gives_are_rejected_in_both_versions():
    bad = bytearray(b"\xa5\x01\xff\xff\x00\x00\x00\x00")
    bad.append(sum(bad) & 0xFF)
    parser = FrameParser(1)
    parser.feed(bytes(bad))
    assert parser.counters.rejected_implausible == 1
    parser = FrameParser(2)
    content = bytes.fromhex("20 0001 00 8000 4000 4000 4000 4000 0800")  # averaged over zero polls
    from drivers.imu_block.packet import seal

    assert parser.feed(seal(content)) == []
    assert parser.counters.rejected_implausible == 1


@pytest.mark.parametrize(("item", "value"), [(0, 4096), (0, 65535), (1, 256), (1, 65535), (2, 65535)])
def test_a_temperature_that_no_chip_gives_is_set_aside_and_the_sample_kept(item, value):
    parser, environment = FrameParser(2), Environment()
    for tick, stated in ((4, (item, 170)), (8, (item, value))):
        (frame,) = parser.feed(
            encode_v2(
                tick_ms=tick, sample_count=4, gyro_counts=2048, tilt_counts=(1024,) * 4, housekeeping=stated
            )
        )
        environment.update(frame)
    assert frame.housekeeping is None
    assert (parser.counters.frames_good, parser.counters.rejected_implausible) == (2, 1)
    known = (
        environment.temperature_gyro_c,
        environment.temperature_tilt_x_c,
        environment.temperature_tilt_y_c,
    )
    assert -300.0 < known[item] < 100.0


@pytest.mark.parametrize("make", [lambda k: v1(k), lambda k: v2(4 * k, count=4)], ids=["v1", "v2"])
@pytest.mark.parametrize("again", [(20,), (18, 19, 20), (20, 20, 20)])
def test_frames_that_come_twice_are_taken_once_and_begin_nothing(make, again):
    version = 1 if len(make(1)) == protocol.V1_WIRE_BYTES else 2
    parser = FrameParser(version)
    order = [*range(1, 21), *again, *range(21, 31)]
    frames = parser.feed(b"".join(make(k) for k in order))
    assert len(frames) == 30
    counters = parser.counters
    assert (counters.rejected_sequence, counters.discontinuities, counters.frames_lost) == (len(again), 0, 0)


@pytest.mark.parametrize("missing", [100, 200, 300, 2814, 5000])
@pytest.mark.parametrize("make", [lambda k: v1(k), lambda k: v2(k, count=1)], ids=["v1", "v2"])
def test_frames_that_noise_swallowed_are_counted_after_the_stream_was_found_again(make, missing):
    parser = FrameParser()
    size = len(make(1))
    before, after = (b"".join(make(k) for k in range(a, a + 40)) for a in (1, 41 + missing))
    noise = bytes([0x55, 0x13]) * (missing * size // 2)
    got = parser.feed(before) + parser.feed(noise) + parser.feed(after)
    assert parser.detected_version == (1 if size == protocol.V1_WIRE_BYTES else 2)
    assert len(got) == 80
    assert parser.counters.frames_lost == missing
    assert parser.counters.locks == 2


@pytest.mark.parametrize("make", [lambda k: v1(k), lambda k: v2(4 * k, count=4)], ids=["v1", "v2"])
@pytest.mark.parametrize("ran", [100, 150, 230, 1200])
def test_a_block_that_starts_again_has_lost_no_frames(make, ran):
    parser = FrameParser()
    parser.feed(b"".join(make(k) for k in range(1, ran)) + b"\xf8" + b"".join(make(k) for k in range(1, 30)))
    assert (parser.counters.frames_lost, parser.counters.discontinuities) == (0, 1)


def test_lost_v2_frames_are_counted_by_tick_also_over_the_wrap():
    parser = FrameParser(2)
    for tick in (65528, 65532, 0, 4, 16, 20):
        parser.feed(v2(tick, count=4))
    assert (parser.counters.frames_good, parser.counters.frames_lost) == (6, 2)
    parser.feed(v2(30, count=10))  # averaging was changed: windows still touch
    assert parser.counters.frames_lost == 2
    parser.feed(v2(10, count=10))  # the block restarted
    assert (parser.counters.frames_lost, parser.counters.discontinuities) == (2, 1)


def test_replies_pass_between_frames_and_cost_none():
    parser = FrameParser()
    stream = b"".join(v2(k) + (REPLY_BYTES if k % 3 == 0 else b"") for k in range(1, 10))
    results = parser.feed(stream)
    assert len(frames_of(results)) == 9
    assert results.count(Pong(1, 513)) == results.count(Identity(2, 2, 1, 0, 7, 4)) == 3
    assert parser.counters.frames_lost == parser.counters.bytes_rejected == 0


def test_the_version_is_found_out_and_found_again_after_a_change():
    parser = FrameParser()
    assert len(parser.feed(b"".join(v1(k) for k in range(1, 301)))) == 300
    assert parser.detected_version == 1
    parser.feed(b"".join(v2(k) for k in range(1, 101)))
    assert parser.detected_version == 2
    parser.feed(b"".join(v1(k) for k in range(1, 301)))
    assert parser.detected_version == 1


def test_no_v2_stream_is_ever_taken_for_v1_nor_the_other_way():
    rng = random.Random(11)
    second = b"".join(
        v2(k, rng.uniform(0, 4095), [rng.uniform(0, 2047)] * 4, value=rng.randrange(65536))
        for k in range(2000)
    )
    first = b"".join(
        v1(k, rng.uniform(1800, 2300), rng.uniform(-1800, 1800), rng.uniform(-9, 9)) for k in range(2000)
    )
    for stream, version in ((second, 2), (first, 1)):
        for start in range(0, 400, 7):
            parser = FrameParser()
            parser.feed(stream[start:])
            assert parser.detected_version == version
            assert parser.counters.frames_lost == 0


def test_a_wrong_version_word_is_refused():
    with pytest.raises(ValueError, match="expected 1, 2 or None"):
        FrameParser(3)


@given(packet=st.binary(max_size=253))
def test_stuffing_comes_back_and_hides_every_zero(packet):
    stuffed = cobs.encode(packet)
    assert 0 not in stuffed
    assert len(stuffed) == len(packet) + 1
    assert cobs.decode(stuffed) == packet


@settings(max_examples=50, deadline=None)
@given(noise=st.binary(max_size=300), cuts=st.lists(st.integers(0, 10**6), max_size=20))
def test_the_block_reads_commands_after_any_noise_in_any_chunks(noise, cuts):
    wanted = protocol.encode_ping(1) + protocol.encode_set_averaging(2, 10) + protocol.encode_reset(3)
    stream = noise + b"\x00" + wanted
    edges = [0, *sorted({cut % (len(stream) + 1) for cut in cuts}), len(stream)]
    parser = CommandParser()
    commands = [c for b, e in itertools.pairwise(edges) for c in parser.feed(stream[b:e])]
    assert commands[-3:] == [protocol.Ping(1), protocol.SetAveraging(2, 10), protocol.Reset(3)]


@pytest.mark.parametrize(
    ("content", "result"),
    [
        ("42 05 00", 2),
        ("42 05 65", 2),
        ("43 05 40 0001", 2),
        ("43 05 01 07d1", 2),
        ("44 05 5255", 2),
        ("4f 05", 1),
    ],
)
def test_a_command_that_cannot_be_obeyed_gets_its_reason(content, result):
    from drivers.imu_block.packet import seal

    content = bytes.fromhex(content)
    assert CommandParser().feed(seal(content)) == [protocol.BadCommand(5, content[0], result)]


@pytest.mark.parametrize(
    "build",
    [
        lambda: v1(1, 4096),
        lambda: v2(1, tilts=(0, 0, 0, 2048)),
        lambda: v2(1, count=0),
        lambda: v2(1, item=4),
        lambda: v2(1, gyro=float("nan")),
        lambda: protocol.encode_set_averaging(1, 101),
        lambda: protocol.encode_self_test(1, 64, 10),
        lambda: protocol.encode_ping(256),
        lambda: encode_reply(Pong(256, 1)),
        lambda: cobs.encode(bytes(254)),
    ],
)
def test_what_the_wire_cannot_carry_is_refused(build):
    with pytest.raises(ValueError, match=r"expected|out of range|does not fit|allowed"):
        build()
