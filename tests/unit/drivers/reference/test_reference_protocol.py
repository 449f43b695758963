import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.reference.protocol import FRAME_SIZE, PoseParser, ReferencePose, encode

FINITE = st.floats(allow_nan=False, allow_infinity=False)
SMALL = st.floats(0.0, 1.0, width=32)
POSES = st.builds(
    ReferencePose,
    vehicle=st.integers(0, 255),
    sequence=st.integers(0, 65535),
    stamp_source_ns=st.integers(-(2**63), 2**63 - 1),
    age_ns=st.integers(0, 2**32 - 1),
    position_table_m=st.tuples(FINITE, FINITE),
    heading_rad=FINITE,
    velocity_table_m_s=st.tuples(FINITE, FINITE),
    rate_rad_s=FINITE,
    pose_covariance=st.tuples(*[SMALL] * 6),
    is_host_clock=st.booleans(),
    is_tracked=st.booleans(),
)


def pose(sequence=0, vehicle=0, **fields):
    return ReferencePose(vehicle, sequence, 10**9, 0, (1.0, 2.0), 0.5, **fields)


def same(left, right):
    return encode(left) == encode(right)


@given(st.lists(POSES, max_size=6), st.lists(st.integers(0, 600), max_size=12))
def test_poses_survive_any_chunking(poses, places):
    stream = b"".join(map(encode, poses))
    edges = [0, *sorted(min(place, len(stream)) for place in places), len(stream)]
    parser = PoseParser()
    reported = [p for a, b in itertools.pairwise(edges) for p in parser.feed(stream[a:b])]
    assert reported == poses
    assert parser.counters.frames_good == len(poses)
    assert parser.counters.bytes_skipped == parser.counters.frames_corrupt == 0


@given(st.binary(max_size=300), st.lists(st.integers(1, 50), max_size=10))
def test_noise_never_raises_and_costs_no_good_frame(noise, sizes):
    stream = noise + encode(pose(5)) + noise + encode(pose(6)) + bytes(FRAME_SIZE)
    parser, reported = PoseParser(), []
    for size in [*sizes, len(stream)]:
        reported += parser.feed(stream[:size])
        stream = stream[size:]
    assert [p.sequence for p in reported] == [5, 6]


@given(st.integers(0, FRAME_SIZE * 8 - 1))
def test_a_flipped_bit_costs_one_frame(bit):
    broken = bytearray(encode(pose(1)))
    broken[bit // 8] ^= 1 << bit % 8
    parser = PoseParser()
    reported = parser.feed(encode(pose(0)) + bytes(broken) + encode(pose(2)))
    assert [p.sequence for p in reported] == [0, 2]
    assert parser.counters.frames_lost == 1
    assert parser.counters.bytes_skipped == FRAME_SIZE


@given(st.integers(0, FRAME_SIZE - 1))
def test_a_lost_byte_costs_one_frame(place):
    middle = encode(pose(1))
    parser = PoseParser()
    reported = parser.feed(encode(pose(0)) + middle[:place] + middle[place + 1 :] + encode(pose(2)))
    assert [p.sequence for p in reported] == [0, 2]


def test_a_header_inside_a_broken_frame_does_not_hide_the_next_frame():
    parser = PoseParser()
    reported = parser.feed(encode(pose(0))[:40] + encode(pose(1)) + encode(pose(2)) + encode(pose(3)))
    assert [p.sequence for p in reported] == [1, 2, 3]
    assert parser.counters.frames_corrupt == 1


def test_the_worked_example_of_the_interface_document_holds():
    example = ReferencePose(
        vehicle=1,
        sequence=65535,
        stamp_source_ns=123_456_789_012,
        age_ns=600_000_000,
        position_table_m=(1.5, -0.25),
        heading_rad=3.0,
        velocity_table_m_s=(0.5, math.nan),
        rate_rad_s=-0.125,
        pose_covariance=(1.0, 0.0, 0.0, 2.0, 0.0, 3.0),
    )
    assert encode(example).hex(" ") == (
        "b5 52 01 58 01 01 ff ff 14 1a 99 be 1c 00 00 00 00 46 c3 23"
        " 00 00 00 00 00 00 f8 3f 00 00 00 00 00 00 d0 bf 00 00 00 00 00 00 08 40"
        " 00 00 00 00 00 00 e0 3f 00 00 00 00 00 00 f8 7f 00 00 00 00 00 00 c0 bf"
        " 00 00 80 3f 00 00 00 00 00 00 00 00 00 00 00 40 00 00 00 00 00 00 40 40 14 d3 b6 21"
    )


def test_gaps_are_counted_per_vehicle_and_a_restart_is_no_gap():
    parser = PoseParser()
    for vehicle, sequence in [(0, 65534), (1, 7), (0, 1), (1, 8), (1, 3)]:
        parser.feed(encode(pose(sequence, vehicle)))
    assert parser.counters.frames_lost == 2


def test_a_tracked_pose_that_is_no_number_is_counted_and_dropped():
    parser = PoseParser()
    lost = ReferencePose(0, 0, 0, 0, (math.nan, 0.0), 0.0)
    assert parser.feed(encode(lost)) == []
    assert parser.counters.frames_implausible == 1
    untracked = ReferencePose(0, 1, 0, 0, (math.nan, 0.0), 0.0, is_tracked=False)
    assert same(parser.feed(encode(untracked))[0], untracked)


@pytest.mark.parametrize(
    "fields",
    [{"age_ns": -1}, {"age_ns": 2**32}, {"vehicle": 256}, {"sequence": -1}, {"stamp_source_ns": 2**63}],
    ids=str,
)
def test_what_does_not_fit_is_refused(fields):
    values = {"vehicle": 0, "sequence": 0, "stamp_source_ns": 0, "age_ns": 0} | fields
    with pytest.raises(ValueError, match=r"age|does not fit"):
        encode(ReferencePose(**values, position_table_m=(0.0, 0.0), heading_rad=0.0))


def test_the_moment_of_a_pose_is_exact_on_a_shared_clock_and_backdated_otherwise():
    late = ReferencePose(0, 0, 5_000, 600, (0.0, 0.0), 0.0)
    assert late.measured_stamp_ns(10_000) == 9_400
    shared = ReferencePose(0, 0, 5_000, 600, (0.0, 0.0), 0.0, is_host_clock=True)
    assert shared.measured_stamp_ns(10_000) == 5_000


def test_the_covariance_is_symmetric_and_in_the_documented_order():
    matrix = pose(pose_covariance=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0)).covariance_matrix()
    assert np.array_equal(matrix, [[1, 2, 3], [2, 4, 5], [3, 5, 6]])
