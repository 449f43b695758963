"""A camera that repeats itself gives no fixes, and the state's sigma says what follows from that."""

import json

import numpy as np
import pytest

from groundstation.frames import wrap_angle
from groundstation.fusion.fix_repeats import REPEATS
from groundstation.parts.fusion.messages import FixAccount, FusionStatus, VehicleState
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.stars.messages import StarFix

FROZEN_S = 4.0


def frozen(stop_s=60.0):
    return (
        '\n[[laboratory.faults]]\nkind = "frozen_camera"\nvehicle = "alpha"\n'
        f"start_s = {FROZEN_S}\nend_s = {stop_s}\nparameters = {{ }}\n"
    )


def assert_truthful(flight, start_s):
    """Truth lies within four sigma of the state, and sigma has grown."""
    states = {state.stamp_ns: state for state in flight.of(VehicleState, start_s=start_s)}
    stamps_ns = np.array(sorted(states))
    compared = 0
    for truth in flight.of(ReferenceState, start_s=start_s):
        at = stamps_ns[np.abs(stamps_ns - truth.stamp_ns).argmin()]
        if abs(at - truth.stamp_ns) > 5_000_000:
            continue
        state = states[at]
        off = [
            *np.subtract(state.position_table_m, truth.position_table_m),
            wrap_angle(state.heading_rad - truth.heading_rad),
        ]
        moved = [*np.abs(truth.velocity_table_m_s), abs(truth.rate_rad_s)]
        slack = 5e-3 * np.array(moved)  # the two are up to 5 ms apart
        assert (np.abs(off) < 4.0 * np.array(state.pose_sigma) + slack).all()
        compared += 1
    assert compared > 50
    first, last = (states[stamps_ns[index]].pose_sigma for index in (0, -1))
    assert (np.array(last) > 1.2 * np.array(first)).all()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_drawn_fixes_that_repeat_are_refused_from_the_first_on(fly, seed):
    flight = fly(frozen(), seed=seed).run(16.0)
    exposures = [
        account for account in flight.of(FixAccount, start_s=0.0) if account.stamp_ns > FROZEN_S * 1e9 + 7e8
    ]
    assert len(exposures) > 10
    assert {(account.used, account.reason) for account in exposures} == {(False, REPEATS)}
    assert flight.of(FusionStatus)[-1].fix_age_s > 10.0
    assert_truthful(flight, FROZEN_S + 2.0)


def test_fixes_are_used_again_when_the_stream_thaws(fly):
    flight = fly(frozen(8.0)).run(10.0)
    late = [account for account in flight.of(FixAccount) if account.stamp_ns > 8.0e9]
    assert late
    assert all(account.used for account in late)


def test_rendered_pictures_that_repeat_are_no_fixes(fly):
    late = ("late_s = 0.6", "late_s = 0.0")
    flight = fly(frozen(), rig="late_pipeline", changes=[late]).run(9.0)
    frozen_fixes = [fix for fix in flight.of(StarFix) if fix.stamp_ns > FROZEN_S * 1e9 + 8e7]
    assert len(frozen_fixes) > 60
    assert not any(fix.fix for fix in frozen_fixes)
    assert {fix.reason.partition(":")[0] for fix in frozen_fixes} == {"frozen picture"}
    before = [fix for fix in flight.of(StarFix) if fix.stamp_ns < FROZEN_S * 1e9]
    assert len(before) > 50
    assert all(fix.fix for fix in before)  # also those of the rest, when nothing moved
    used = [account for account in flight.of(FixAccount) if account.used]
    assert max(account.stamp_ns for account in used) < FROZEN_S * 1e9 + 8e7
    assert_truthful(flight, FROZEN_S + 1.0)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_camera_that_repeats_a_pose_accuses_no_gyro(fly, seed):
    """The mock-up turns on while the repeated heading stands: the camera is wrong, and alone is named."""
    more = frozen().replace(f"start_s = {FROZEN_S}", "start_s = 9.0")
    flight = fly(more, rig="two_mock_ups_drawn", seed=seed)
    flight.run(7.0)
    flight.request("go_to", json.dumps({"x_m": -0.5, "y_m": 0.1, "heading_rad": 2.5}))
    flight.run(8.0)
    turned = [abs(row.rate_rad_s) for row in flight.of(ReferenceState, start_s=9.0, stop_s=10.0)]
    assert max(turned) > 0.05
    assert "camera_frozen" in flight.faults()
    assert flight.faults() <= {"camera_frozen", "star_outage", "position_uncertain"}
