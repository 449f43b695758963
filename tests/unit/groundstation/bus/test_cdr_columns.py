"""Fields read as columns are those that the codec reads one by one."""

import numpy as np
import pytest

from groundstation.bus.cdr import CodecError, codec_of
from groundstation.bus.cdr_columns import columns_of, decode_columns, joined
from groundstation.parts.fusion.messages import FixAccount, VehicleState
from groundstation.parts.imu.messages import Imu
from groundstation.parts.operation.messages import Latency
from groundstation.parts.valves.messages import ValveCommand


def states(count, vehicle="alpha"):
    """Texts of every length before the last field, so that it lies at every alignment."""
    return [
        VehicleState(
            10**18 + number, vehicle, (0.1 * number, -1.0), 0.5, (0.0, number), -0.25, (1.0, 2.0, 3.0),
            "flying"[: number % 7], number * 10**12,
        )
        for number in range(count)
    ]  # fmt: skip


def packed(messages, between=b"\xff\xff\xff"):
    """The payloads with rubbish between them, and where each begins and ends."""
    out, starts, stops = bytearray(between), [], []
    for message in messages:
        starts.append(len(out))
        out += codec_of(type(message)).encode(message)
        stops.append(len(out))
        out += between
    return np.frombuffer(bytes(out), np.uint8), np.array(starts), np.array(stops)


def same(messages, names):
    found = decode_columns(type(messages[0]), names, *packed(messages))
    expected = columns_of(messages, names)
    assert found.stamp_ns.tolist() == expected.stamp_ns.tolist() == [one.stamp_ns for one in messages]
    for name in names:
        np.testing.assert_array_equal(found[name], expected[name])
    return found


@pytest.mark.parametrize("vehicle", ["", "a", "beta", "delta", "a_long_name"])
def test_fields_before_and_behind_texts_of_any_length(vehicle):
    found = same(states(20, vehicle), ["position_table_m", "pose_sigma", "status", "fix_stamp_ns"])
    assert found["position_table_m"].shape == (20, 2)
    assert found["status"][6] == b"flying"
    assert found["fix_stamp_ns"].dtype == np.int64


def test_bytes_of_different_lengths_are_filled_up_with_zeros():
    commands = [
        ValveCommand(number, "alpha", 1, 2, bytes(range(1, number + 1)), "open"[:number], 3, 4, 0.5, 0)
        for number in range(9)
    ]
    found = same(commands, ["on_time_ms", "gate", "stop_grace_s"])
    assert found["on_time_ms"].shape == (9, 8)
    assert found["on_time_ms"][3].tolist() == [1, 2, 3, 0, 0, 0, 0, 0]


def test_numbers_behind_a_text_in_the_middle():
    samples = [
        Imu(n, "alpha", n, 4, 0.004, 1e-5, 0.1, (1.0, 2.0), 20.0, n % 2 == 0, "stuck"[: n % 6], 7 * n, 7)
        for n in range(12)
    ]
    assert same(samples, ["frames_lost", "valid"])["frames_lost"][-1] == 77


def test_two_texts_side_by_side():
    fixes = [
        FixAccount(n, "alpha", "stars" * n, n == 1, "late" * n, (0.1, 0.2, 0.3 * n), 3.0, 0.5)
        for n in range(4)
    ]
    same(fixes, ["source", "used", "reason", "innovation", "age_s"])


def test_what_is_cut_off_is_refused_and_not_read_from_what_follows():
    data, starts, stops = packed(states(6))
    for cut in (1, 9, 40, int(stops[3] - starts[3]) - 1):
        wrong = stops.copy()
        wrong[3] -= cut
        with pytest.raises(CodecError, match="VehicleState: cut off"):
            decode_columns(VehicleState, ["fix_stamp_ns"], data, starts, wrong)


def test_another_encapsulation_is_refused():
    data, starts, stops = packed(states(3))
    wrong = data.copy()
    wrong[starts[1] + 1] = 0
    with pytest.raises(CodecError, match="little-endian"):
        decode_columns(VehicleState, ["status"], wrong, starts, stops)


def test_what_is_no_column_is_a_mistake_of_the_programmer():
    ages = [Latency(1, "alpha", ("fix",), (0.1,), (0.2,))]
    with pytest.raises(TypeError, match=r"Latency\.stages is a sequence of texts"):
        decode_columns(Latency, ["p50_s"], *packed(ages))


def test_pieces_are_joined_in_their_order():
    first, second = states(3), states(5, "alpha")
    both = joined([columns_of(first, ["status"]), columns_of(second, ["status"])])
    assert len(both) == 8
    assert both["status"].tolist() == [one.status.encode() for one in (*first, *second)]
