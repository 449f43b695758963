import math
from itertools import pairwise

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from drivers.laboratory import ChannelKind, InjectOrder
from drivers.motion_capture.pose import MotionCapturePose
from firmware_emulator.laboratory import EmulatedLaboratory
from firmware_emulator.scene_files import SceneError

MS = 1_000_000
S = 1_000_000_000
EXACT = {"sigma_m": 0.0, "sigma_rad": 0.0, "delay_jitter_s": 0.0}
SINGLE = 1e-6  # float32 at 1 m is good to 6e-8; products of a few


def laboratory(seed=1, vehicle=None, **settings):
    vehicle = {"start_m": [0.5, -0.25], "start_heading_deg": 30.0, **(vehicle or {})}
    vehicles = [{"name": "alpha", **vehicle}, {"name": "beta", "start_m": [-1.0, 0.0]}]
    return EmulatedLaboratory({"vehicles": vehicles, "motion_capture": settings}, seed=seed)


def poses(made, until_ns, name=None):
    return [
        (a.stamp_ns, a.data)
        for a in made.advance(until_ns)
        if a.channel == "motion_capture" and name in (None, a.data.name)
    ]


def test_it_has_a_channel_of_poses_if_the_scenario_has_the_system():
    assert laboratory().channels()["motion_capture"] is ChannelKind.POSES
    assert "motion_capture" not in EmulatedLaboratory({"vehicles": [{"name": "alpha"}]}).channels()


def test_every_body_comes_once_a_frame_at_the_rate_after_the_delay():
    got = poses(laboratory(rate_hz=50.0, delay_s=0.1, **EXACT), S)
    assert [(stamp_ns, pose.frame, pose.name) for stamp_ns, pose in got] == [
        ((k + 1) * 20 * MS + 100 * MS, k, name) for k in range(45) for name in ("alpha", "beta")
    ]


def test_a_rate_that_divides_no_second_does_not_drift():
    got = poses(laboratory(rate_hz=120.0, delay_s=0.0, **EXACT), 10 * S, "alpha")
    assert len(got) == 1200
    assert got[-1][0] == 10 * S


def expected(x_m, y_m, heading_rad, up, origin, yaw_deg, pivot, pivot_yaw_deg):
    """Another way to the same: rotation matrices, from the meaning of the keys."""
    from_z_up = {
        "z": Rotation.identity(),
        "y": Rotation.from_matrix([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),  # up is y, z is -y
    }[up]
    table_from_capture = Rotation.from_euler("z", yaw_deg, degrees=True) * from_z_up.inv()
    table_from_body = Rotation.from_euler("z", heading_rad)
    position_table = np.array([x_m, y_m, 0.0]) + table_from_body.apply(pivot)
    position = table_from_capture.inv().apply(position_table - np.array(origin))
    table_from_rigid = Rotation.from_euler("z", heading_rad + math.radians(pivot_yaw_deg)) * from_z_up.inv()
    return position, table_from_capture.inv() * table_from_rigid


@pytest.mark.parametrize("up", ["z", "y"])
@pytest.mark.parametrize("yaw_deg", [0.0, 35.0, -170.0])
@pytest.mark.parametrize("pivot_yaw_deg", [0.0, 90.0])
def test_poses_are_in_the_systems_own_frame(up, yaw_deg, pivot_yaw_deg):
    frame = {"origin_table_m": [0.4, -1.0, 0.05], "pivot_body_m": [0.03, -0.02, 0.31]}
    made = laboratory(up=up, yaw_deg=yaw_deg, pivot_yaw_deg=pivot_yaw_deg, **frame, **EXACT)
    _, pose = poses(made, 100 * MS, "alpha")[0]
    position, turn = expected(
        0.5,
        -0.25,
        math.radians(30.0),
        up,
        frame["origin_table_m"],
        yaw_deg,
        frame["pivot_body_m"],
        pivot_yaw_deg,
    )
    assert pose.position_m == pytest.approx(position, abs=SINGLE)
    assert (Rotation.from_quat(pose.quaternion_xyzw).inv() * turn).magnitude() < SINGLE


def test_a_body_that_lies_as_the_system_does_is_not_turned():
    made = laboratory(up="y", yaw_deg=30.0, **EXACT)  # alpha's heading
    _, pose = poses(made, 100 * MS, "alpha")[0]
    assert Rotation.from_quat(pose.quaternion_xyzw).magnitude() < SINGLE


def test_noise_is_as_large_as_stated_in_every_direction():
    sigma_m, sigma_rad = 0.001, 0.002
    made = laboratory(sigma_m=sigma_m, sigma_rad=sigma_rad, rate_hz=1000.0)
    got = [pose for _, pose in poses(made, 4 * S, "beta")]
    places = np.array([pose.position_m for pose in got]) - (-1.0, 0.0, 0.3)
    turns = Rotation.from_quat([pose.quaternion_xyzw for pose in got]).as_rotvec()
    relative = 4.0 / math.sqrt(2.0 * len(got))  # four standard deviations of a standard deviation
    assert places.std(axis=0) == pytest.approx(sigma_m, rel=relative)
    assert turns.std(axis=0) == pytest.approx(sigma_rad, rel=relative)
    assert abs(places.mean(axis=0)).max() < 4.0 * sigma_m / math.sqrt(len(got))


def test_poses_are_singles_as_on_the_wire():
    _, pose = poses(laboratory(), 100 * MS, "alpha")[0]
    for value in (*pose.position_m, *pose.quaternion_xyzw):
        assert value == float(np.float32(value))


def test_bodies_are_hidden_for_as_long_and_as_often_as_stated_each_on_its_own():
    got = poses(laboratory(occlusion_rate_hz=8.0, occlusion_s=0.05, rate_hz=200.0), 25 * S)
    tracked = {name: [p.is_tracked for _, p in got if p.name == name] for name in ("alpha", "beta")}
    assert tracked["alpha"] != tracked["beta"]
    for seen in tracked.values():
        # 125 ms until the next gap, 50 ms of it: two sevenths, and 143 gaps. One sigma of either is 9 %.
        assert seen.count(False) / len(seen) == pytest.approx(2.0 / 7.0, rel=0.27)
        gaps = sum(before and not after for before, after in pairwise(seen))
        assert gaps == pytest.approx(25.0 / 0.175, rel=0.27)


def test_an_order_hides_one_body_and_no_other():
    made = laboratory(delay_jitter_s=0.0)
    before = poses(made, S)
    made.deliver(S, "laboratory", InjectOrder("hidden_body", "alpha", for_s=0.5))
    during, after = poses(made, 3 * S // 2), poses(made, 2 * S)
    assert all(pose.is_tracked for _, pose in before)
    assert [p.name for _, p in during if not p.is_tracked] == ["alpha"] * 49  # at 1.01 to 1.49 s
    assert all(pose.is_tracked for _, pose in after)
    hidden = next(p for _, p in during if not p.is_tracked)
    assert repr(hidden) == repr(MotionCapturePose.untracked("alpha", hidden.frame))


def test_gaps_do_not_move_the_noise():
    free = dict(poses_by_frame(laboratory(sigma_m=0.001)))
    gaps = dict(poses_by_frame(laboratory(sigma_m=0.001, occlusion_rate_hz=2.0)))
    seen = [frame for frame, pose in gaps.items() if pose.is_tracked]
    assert 0 < len(seen) < len(free)
    assert all(free[frame] == gaps[frame] for frame in seen)


def poses_by_frame(made):
    return [(pose.frame, pose) for _, pose in poses(made, 3 * S, "alpha")]


def test_the_system_moves_no_other_devices_numbers():
    vehicles = [{"name": "alpha"}, {"name": "beta", "start_m": [-1.0, 0.0]}]
    without = EmulatedLaboratory({"vehicles": vehicles}, seed=6).advance(2 * S)
    with_it = EmulatedLaboratory({"vehicles": vehicles, "motion_capture": {}}, seed=6).advance(2 * S)
    assert [repr(a.data) for a in with_it if a.channel != "motion_capture"] == [repr(a.data) for a in without]


def test_rigid_bodies_bear_the_names_that_the_system_gave_them():
    got = poses(laboratory(names={"beta": "Rigid Body 2"}), 100 * MS)
    assert {pose.name for _, pose in got} == {"alpha", "Rigid Body 2"}


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        ({"rate_hz": 0.0}, ("rate_hz",)),
        ({"up": "x"}, ("up",)),
        ({"colour": "red"}, ("colour",)),
        ({"names": {"alpha": ""}}, ()),
        ({"names": {"alpha": "x" * 300}}, ()),
    ],
)
def test_a_wrong_section_names_its_key(settings, key):
    with pytest.raises(ValidationError) as raised:
        laboratory(**settings)
    assert raised.value.errors()[0]["loc"] == ("motion_capture", *key)


@pytest.mark.parametrize(
    ("names", "complaint"),
    [
        ({"alpha": "one", "beta": "one"}, "two vehicles bear one rigid body's name"),
        ({"alpha": "beta"}, "two vehicles bear one rigid body's name"),
        ({"gamma": "one"}, "no vehicle 'gamma'"),
    ],
)
def test_names_that_do_not_fit_the_vehicles_are_refused(names, complaint):
    with pytest.raises(SceneError, match=complaint):
        laboratory(names=names)
