"""From a system's frame to the table: against rotation matrices written out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from groundstation.frames import wrap_angle
from groundstation.parts.motion_capture.capture_frame import CaptureFrame
from groundstation.parts.motion_capture.capture_reader import CapturedBody, CaptureReader
from groundstation.parts.motion_capture.messages import CapturedPose, CaptureFix

LENGTHS_M = st.floats(-3.0, 3.0)
ANGLES_RAD = st.floats(-math.pi, math.pi)
# columns: the system's x, y, z in z-up axes
Z_UP = np.eye(3)
Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def about_z(angle_rad):
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@given(
    st.sampled_from([("z", Z_UP), ("y", Y_UP)]),
    st.tuples(LENGTHS_M, LENGTHS_M, LENGTHS_M),
    ANGLES_RAD,
    st.tuples(LENGTHS_M, LENGTHS_M),
    ANGLES_RAD,
    st.tuples(LENGTHS_M, LENGTHS_M),
    ANGLES_RAD,
)
def test_a_pose_comes_back(axes, origin, yaw, position, heading, pivot, pivot_yaw):
    up, basis = axes
    table_from_capture = about_z(yaw) @ basis
    lever = about_z(heading) @ np.array([*pivot, 0.3])
    seen = table_from_capture.T @ (np.array([*position, 0.0]) + lever - np.array(origin))
    body = table_from_capture.T @ about_z(heading + pivot_yaw) @ basis
    frame = CaptureFrame(up, origin, yaw)
    quaternion = tuple(Rotation.from_matrix(body).as_quat().tolist())
    found = frame.pose(tuple(seen.tolist()), quaternion, pivot, pivot_yaw, up)
    assert (found.x_m, found.y_m) == pytest.approx(position, abs=1e-9)
    assert abs(wrap_angle(found.heading_rad - heading)) < 1e-9
    assert found.tilt_rad < 1e-6


def reader(**changes):
    body = CapturedBody("alpha", (0.0, 0.0), 0.0, is_reference=False)
    given_ = {"delay_s": 0.01, "delay_sigma_s": 0.001, "sigma_xy_m": 2e-4, "sigma_heading_rad": 5e-4}
    return CaptureReader(
        CaptureFrame("z", (0.0, 0.0, 0.0), 0.0), {"one": body}, **(given_ | changes), body_up="z"
    )


def pose(quaternion=(0.0, 0.0, 0.0, 1.0), body="one", *, is_tracked=True):
    return CapturedPose(2_000_000_000, "", body, 7, (1.0, 2.0, 0.3), quaternion, is_tracked)


def test_a_fix_is_stamped_with_its_exposure_and_says_its_covariance():
    (fix,) = reader().receive(pose(), 2_000_000_000)
    assert isinstance(fix, CaptureFix)
    assert (fix.vehicle, fix.stamp_ns, fix.stamp_sigma_s) == ("alpha", 1_990_000_000, 0.001)
    assert (fix.x_m, fix.y_m, fix.heading_rad) == pytest.approx((1.0, 2.0, 0.0))
    assert np.array(fix.covariance).reshape(3, 3) == pytest.approx(np.diag([4e-8, 4e-8, 2.5e-7]))


@pytest.mark.parametrize(
    ("given_", "words"),
    [
        (pose(is_tracked=False), "not tracked"),
        (pose((math.sin(0.3), 0.0, 0.0, math.cos(0.3))), "tilted by 34 deg"),
        (pose((0.0, 0.0, 0.0, 0.5)), "a quaternion of length 0.5"),
        (pose((math.nan,) * 4), "a quaternion of length nan"),
    ],
)
def test_what_cannot_be_a_mock_up_is_no_fix(given_, words):
    (fix,) = reader().receive(given_, 0)
    assert not fix.fix
    assert words in fix.reason
    assert math.isnan(fix.x_m)


def test_a_body_of_nobody_is_left_out():
    assert list(reader().receive(pose(body="other"), 0)) == []
