"""Poses of a stream: placed by their ages, and honest about a machine that is held up."""

import math

import pytest

from drivers.reference.protocol import ReferencePose, encode
from groundstation.parts.imu.messages import Imu
from groundstation.parts.stars.fix_reader import FixReader
from groundstation.parts.stars.messages import FixBytes

MS = 1_000_000
USUAL_MS = 8


def sample(end_ms):
    return Imu(
        end_ms * MS, "alpha", end_ms, 10, 0.01, 1e-4, 0.1, (0.0, 0.0), math.nan, True, "", 0, 7
    )  # fmt: skip


def reader_after(late_ms):
    """A reader that received samples, each so many ms later than usual."""
    reader = FixReader("alpha", 0.002, 0.005)
    for count, late in enumerate(late_ms):
        assert list(reader.receive(sample(10 * count), (10 * count + USUAL_MS + late) * MS)) == []
    return reader, (10 * (len(late_ms) - 1) + USUAL_MS + late_ms[-1]) * MS


def pose(*, is_host_clock=False, stamp_ns=0):
    return ReferencePose(0, 1, stamp_ns, 15 * MS, (0.1, 0.2), 0.3, is_host_clock=is_host_clock)


@pytest.mark.parametrize(
    ("late_ms", "sigma_s"), [([0] * 50, 0.002), ([0] * 50 + [4], 0.002), ([0] * 50 + [80], 0.08)]
)
def test_a_fix_that_comes_while_samples_are_held_up_is_stamped_no_better_than_they_were(late_ms, sigma_s):
    reader, now_ns = reader_after(late_ms)
    (fix,) = reader.receive(FixBytes(now_ns, "alpha", encode(pose())), now_ns)
    assert fix.stamp_ns == now_ns - 15 * MS
    assert fix.stamp_sigma_s == pytest.approx(sigma_s, rel=0.02)


def test_a_fix_that_was_stamped_by_the_hosts_clock_is_placed_whatever_is_held_up():
    reader, now_ns = reader_after([0] * 50 + [80])
    (fix,) = reader.receive(
        FixBytes(now_ns, "alpha", encode(pose(is_host_clock=True, stamp_ns=now_ns - 70 * MS))), now_ns
    )
    assert fix.stamp_sigma_s == 0.002
    assert fix.stamp_ns == now_ns - 70 * MS
