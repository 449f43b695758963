import numpy as np
import pytest

from firmware_emulator.failures import Failure

from .exposures import expose

MS = 1_000_000
S = 1_000_000_000


def test_an_exposure_knows_where_the_vehicle_was_when_the_shutter_moved():
    first = expose(1)[0]
    assert first.start == pytest.approx((0.01, 0.0, 0.05), abs=1e-12)
    assert first.end == pytest.approx((0.013, 0.0, 0.065), abs=1e-12)
    assert (first.middle_ns, first.arrival_ns) == (115 * MS, 195 * MS)


def test_pictures_never_overtake_each_other_and_scatter_as_stated():
    exposures = expose(60, delay_jitter_s=0.005)
    delays = [exposure.arrival_ns - exposure.middle_ns for exposure in exposures]
    assert np.std(delays) == pytest.approx(5 * MS, rel=0.1)
    assert [e.sequence for e in exposures] == list(range(len(exposures)))
    wild = [exposure.arrival_ns for exposure in expose(20, delay_jitter_s=0.2, delay_s=1.3)]
    assert wild == sorted(wild)


def test_a_frozen_camera_repeats_one_pose_and_a_silent_one_counts_on():
    frozen = expose(2, [Failure("frozen_camera", S, None, {})])
    assert len({exposure.start for exposure in frozen[-5:]}) == 1
    assert len({exposure.sequence for exposure in frozen}) == len(frozen)
    first = next(exposure for exposure in frozen if exposure.middle_ns >= S)
    assert {exposure.noise for exposure in frozen[first.sequence + 1 :]} == {first.sequence}
    silent = expose(2, [Failure("silent_camera", S // 2, S, {})])
    gaps = np.diff([exposure.sequence for exposure in silent])
    assert sorted(set(gaps)) == [1, 6]


def test_sky_failures_are_marked_for_whoever_draws():
    marked = expose(2, [Failure("dead_sky", S, None, {}), Failure("false_lights", 0, S, {"count": 7.0})])
    assert [e.is_sky_dead for e in marked] == [e.middle_ns >= S for e in marked]
    assert {e.false_lights for e in marked if e.middle_ns < S} == {7}
