import numpy as np
import pytest

from firmware_emulator.devices.star_camera import StarCamera
from firmware_emulator.failures import Failure, Failures
from firmware_emulator.plant.air_table import FloorPulses, Surface
from firmware_emulator.plant.body import Body
from firmware_emulator.plant.motion_state import Motion, PollGrid
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import GasSupply, ThrusterBank, ValveTiming

MS = 1_000_000
S = 1_000_000_000


def gliding_vehicle():
    rng = np.random.default_rng(0)
    bank = ThrusterBank([], (0.0, 0.0), ValveTiming(), GasSupply(), rng)
    level, quiet = Surface((0.0, 0.0), 0.0, 1.0, rng), FloorPulses(0.0, 0.0, 0.1, rng)
    return Vehicle(
        Body(), Motion(0.0, 0.0, 0.0, 0.1, 0.0, 0.5), bank, level, quiet, 0.3, True, PollGrid(0, 0.0)
    )


def expose(seconds, failures=(), **changes):
    settings = {
        "rate_hz": 10.0, "exposure_s": 0.02, "readout_s": 0.01, "delay_s": 0.08, "delay_jitter_s": 0.0,
    } | changes  # fmt: skip
    rng = np.random.default_rng(1)
    camera = StarCamera(gliding_vehicle(), **settings, failures=Failures(failures), rng=rng, start_ns=0)
    while camera.next_ns <= seconds * S:
        camera.run(camera.next_ns)
    return [exposure for _, exposure in camera.take(1000 * S)]


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
    assert {exposure.repeats for exposure in frozen[first.sequence + 1 :]} == {first.sequence}
    assert {exposure.repeats for exposure in frozen[: first.sequence + 1]} == {None}
    silent = expose(2, [Failure("silent_camera", S // 2, S, {})])
    gaps = np.diff([exposure.sequence for exposure in silent])
    assert sorted(set(gaps)) == [1, 6]


def test_sky_failures_are_marked_for_whoever_draws():
    marked = expose(2, [Failure("dead_sky", S, None, {}), Failure("false_lights", 0, S, {"count": 7.0})])
    assert [e.is_sky_dead for e in marked] == [e.middle_ns >= S for e in marked]
    assert {e.false_lights for e in marked if e.middle_ns < S} == {7}
