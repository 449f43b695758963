"""What fails about cameras: their exposures, and the fixes that are drawn in their place."""

import math
from dataclasses import asdict, replace

import numpy as np
import pytest

from drivers.reference.protocol import PoseParser
from drivers.valve_bus.protocol import ValveCommand, encode
from firmware_emulator.devices.repeated_pictures import RepeatedPictures
from firmware_emulator.devices.sky_renderer import SkyRenderer
from firmware_emulator.devices.star_camera import Exposure
from firmware_emulator.failures import Failure, Failures
from firmware_emulator.laboratory import EmulatedLaboratory

from .exposures import expose

MS = 1_000_000
S = 1_000_000_000


def content(exposure):
    """What decides the picture, beside its times."""
    return replace(exposure, sequence=0, middle_ns=0, arrival_ns=0)


def test_a_frozen_camera_repeats_its_picture_with_its_noise():
    exposures = expose(3, [Failure("frozen_camera", S, 2 * S, {})])
    frozen = [content(e) for e in exposures if S <= e.middle_ns < 2 * S]
    assert set(frozen) == {frozen[0]}
    assert frozen[0] == content(exposures[exposures[0].sequence + 9])
    fresh = [e for e in exposures if not S <= e.middle_ns < 2 * S]
    assert [e.noise for e in fresh] == [e.sequence for e in fresh]


def test_a_repeating_camera_loops_its_last_pictures_in_their_order():
    exposures = expose(3, [Failure("repeating_camera", S, 2 * S, {"pictures": 3.0})])
    before = [content(e) for e in exposures if e.middle_ns < S]
    looped = [content(e) for e in exposures if S <= e.middle_ns < 2 * S]
    assert looped == (before[-3:] * 4)[: len(looped)]
    after = [e for e in exposures if e.middle_ns >= 2 * S]
    assert [e.noise for e in after] == [e.sequence for e in after]
    assert [e.sequence for e in exposures] == list(range(len(exposures)))


def test_a_camera_that_repeats_from_its_first_picture_on_repeats_that():
    exposures = expose(1, [Failure("repeating_camera", 0, None, {"pictures": 3.0})])
    assert len({content(e) for e in exposures}) == 1


def test_a_second_failure_of_one_kind_loops_anew():
    failures = Failures(
        [Failure("repeating_camera", start, start + 3, {"pictures": 2.0}) for start in (4, 12)]
    )
    repeated = RepeatedPictures(failures)
    assert [repeated.shown(age, age) for age in range(16)] == [
        0, 1, 2, 3, 2, 3, 2, 7, 8, 9, 10, 11, 10, 11, 10, 15,
    ]  # fmt: skip


def test_a_torn_picture_has_the_one_before_below():
    exposures = expose(3, [Failure("torn_camera", S, 2 * S, {})])
    healthy = expose(3)
    torn = [e for e in exposures if S <= e.middle_ns < 2 * S]
    assert len(torn) == 10
    for exposure in torn:
        assert exposure.lower == healthy[exposure.sequence - 1]
        assert replace(exposure, lower=None) == healthy[exposure.sequence]
    assert all(e.lower is None for e in exposures if e not in torn)


def test_a_slow_camera_sends_one_of_several_and_later():
    exposures = expose(3, [Failure("slow_camera", S, 2 * S, {"delay_s": 0.3, "keep_one_in": 4.0})])
    slow = [e for e in exposures if S <= e.middle_ns < 2 * S]
    assert [e.sequence for e in slow] == [12, 16]
    assert [e.arrival_ns - e.middle_ns for e in slow] == [380 * MS] * 2
    assert {e.arrival_ns - e.middle_ns for e in exposures if e.middle_ns > 2300 * MS} == {80 * MS}


def test_wrong_fixes_are_pictures_from_elsewhere():
    by = {"dx_m": 0.1, "dy_m": -0.2, "dheading_deg": 30.0}
    wrong = expose(2, [Failure("wrong_fixes", S, None, by)])
    for exposure, healthy in zip(wrong, expose(2), strict=True):
        off = np.subtract((exposure.start, exposure.end), (healthy.start, healthy.end))
        expected = (0.1, -0.2, math.pi / 6) if exposure.middle_ns >= S else (0.0, 0.0, 0.0)
        assert off == pytest.approx(np.array([expected, expected]), abs=1e-12)


class Stripes:
    """Stands for the sky camera: a picture that shows where and with which noise it was drawn."""

    def render(self, start, end, *, sequence, **_):
        return np.full((6, 2), 10 * sequence + round(start[0]), np.uint8)


def test_a_torn_picture_is_drawn_from_both_exposures_here_and_in_the_camera_process():
    before = Exposure(4, (1.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0, 0, False, 0, noise=4)
    torn = replace(before, sequence=5, start=(2.0, 0.0, 0.0), noise=5, lower=before)
    renderer = SkyRenderer(Stripes())
    for exposure in (torn, SkyRenderer.exposure(asdict(torn))):
        assert exposure == torn
        assert renderer.render(exposure)[:, 0].tolist() == [52] * 3 + [41] * 3


def fixes(kind=None, end_s=2.0, seconds=3.0, **parameters):
    """Drawn fixes with their arrivals; the failure acts from 1 s on, the mock-up glides and turns."""
    vehicle = {
        "name": "alpha", "floating": True, "start_velocity_m_s": [0.1, 0.0], "start_rate_deg_s": 20.0,
        "camera": {"rate_hz": 10.0, "delay_s": 0.1, "delay_jitter_s": 0.0, "sigma_xy_m": 0.001},
    }  # fmt: skip
    row = {"kind": kind, "vehicle": "alpha", "start_s": 1.0, "end_s": end_s, "parameters": parameters}
    config = {"vehicles": [vehicle], "failures": [row] if kind else []}
    parser = PoseParser()
    found = []
    laboratory = EmulatedLaboratory(config, seed=3)
    for tick in range(round(50 * seconds)):  # a node without commands cuts its air
        command = ValveCommand(0, tick & 15, 0, (0,) * 8)
        laboratory.deliver(tick * 20 * MS, "valve_bus", encode(command))
        for arrival in laboratory.advance((tick + 1) * 20 * MS):
            if arrival.channel == "alpha/fixes":
                found += [(arrival.stamp_ns, pose) for pose in parser.feed(arrival.data)]
    return found


def poses(found, start_ns=0, end_ns=10 * S):
    return [
        (*pose.position_table_m, pose.heading_rad)
        for _, pose in found
        if start_ns <= pose.stamp_source_ns < end_ns
    ]


def test_drawn_fixes_of_a_frozen_camera_are_equal_to_the_bit():
    assert len(set(poses(fixes("frozen_camera"), S, 2 * S))) == 1
    assert len(set(poses(fixes("frozen_camera"), 2 * S))) == 10


def test_drawn_fixes_of_a_repeating_camera_come_again():
    found = fixes("repeating_camera", pictures=4)
    last = poses(found, 0, S)[-4:]
    assert poses(found, S, 2 * S) == [*last, *last, *last[:2]]


def test_drawn_fixes_may_all_be_wrong_alike():
    wrong = fixes("wrong_fixes", dx_m=0.1, dy_m=-0.2, dheading_deg=30.0)
    off = np.subtract(poses(wrong, S, 2 * S), poses(fixes(), S, 2 * S))
    assert off == pytest.approx(np.tile((0.1, -0.2, math.pi / 6), (10, 1)), abs=1e-8)
    assert poses(wrong, 2 * S) == poses(fixes(), 2 * S)


def test_drawn_fixes_of_a_torn_picture_lie_midway():
    healthy = poses(fixes())
    torn = poses(fixes("torn_camera"))
    first = next(index for index, (a, b) in enumerate(zip(torn, healthy, strict=True)) if a != b)
    expected = (np.array(healthy[first - 1]) + np.array(healthy[first])) / 2
    assert torn[first] == pytest.approx(tuple(expected), abs=1e-7)
    assert sum(a != b for a, b in zip(torn, healthy, strict=True)) == 10


def test_drawn_fixes_of_a_slow_camera_are_few_and_late_and_do_not_know_it():
    slow = [
        (at, p)
        for at, p in fixes("slow_camera", delay_s=0.25, keep_one_in=5)
        if 1 <= p.stamp_source_ns / S < 2
    ]
    assert [at - pose.stamp_source_ns for at, pose in slow] == [350 * MS] * 2
    assert {pose.age_ns for _, pose in slow} == {100 * MS}
