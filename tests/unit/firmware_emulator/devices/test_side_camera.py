"""The side camera's shutter: where all are meanwhile, when pictures arrive, what goes wrong with them."""

import numpy as np
import pytest

from firmware_emulator.devices.side_camera import SideCamera, SideCameraConfig
from firmware_emulator.failures import Failure, Failures

from .exposures import gliding_vehicle

MS, S = 1_000_000, 1_000_000_000


def expose(seconds, failures=(), **changes):
    plain = {"rate_hz": 10.0, "exposure_s": 0.02, "delay_s": 0.05, "delay_jitter_s": 0.0}
    settings = SideCameraConfig(camera="c", bodies="b", **{**plain, **changes})
    rng, others = np.random.default_rng(1), {"beta": gliding_vehicle()}
    camera = SideCamera(gliding_vehicle(), others, settings, Failures(failures), rng, 0)
    while camera.next_ns <= seconds * S:
        assert camera.next_output_ns > 0
        camera.run(camera.next_ns)
    return [exposure for _, exposure in camera.take(1000 * S)]


def test_an_exposure_knows_where_all_were_when_the_shutter_moved():
    first = expose(1)[0]
    opens_s, closes_s = 100 / 3 * 1e-3, 100 / 3 * 1e-3 + 0.02
    for start, end in (first.own, first.others["beta"]):
        assert start == pytest.approx((0.1 * opens_s, 0.0, 0.5 * opens_s), abs=1e-9)
        assert end == pytest.approx((0.1 * closes_s, 0.0, 0.5 * closes_s), abs=1e-9)
    assert first.arrival_ns == pytest.approx(33_333_333 + 10 * MS + 50 * MS, abs=1)


def test_pictures_keep_their_order_however_late_they_are():
    arrivals = [exposure.arrival_ns for exposure in expose(20, delay_jitter_s=0.2, delay_s=1.3)]
    assert arrivals == sorted(arrivals)
    assert len(set(arrivals)) == len(arrivals)


def test_a_dark_view_and_a_hand_are_marked_for_whoever_draws():
    marked = expose(
        2, [Failure("dark_side_view", S, None, {}), Failure("covered_side_camera", 0, S, {"share": 0.4})]
    )
    assert [exposure.is_dark for exposure in marked] == [False] * 10 + [True] * 10
    assert {exposure.covered_share for exposure in marked[:10]} == {0.4}
    assert {exposure.covered_share for exposure in marked[10:]} == {0.0}


def test_a_frozen_camera_repeats_place_and_noise_and_a_silent_one_counts_on():
    frozen = expose(2, [Failure("frozen_side_camera", S, None, {})])[-5:]
    assert len({(exposure.own, exposure.noise) for exposure in frozen}) == 1
    assert len({exposure.sequence for exposure in frozen}) == 5
    silent = expose(2, [Failure("silent_side_camera", S // 2, S, {})])
    assert sorted(set(np.diff([exposure.sequence for exposure in silent]).tolist())) == [1, 6]


def test_an_exposure_longer_than_a_period_is_refused():
    with pytest.raises(ValueError, match="longer than a period"):
        SideCameraConfig(camera="c", bodies="b", rate_hz=100.0, exposure_s=0.02)
