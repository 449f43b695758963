"""The published methods close the loop, and the rigs that fly them differ from ours in nothing else."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from groundstation.parts.fusion.messages import FusionStatus, VehicleState
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.stars.messages import StarFix
from groundstation.rig.read import load_rig, parse_rig
from groundstation.runners.make_runner import make_runner

RIGS = Path(__file__).parents[2] / "examples" / "rigs"
DRAWN = RIGS / "drawn_fixes.toml"


class Seen:
    """What a run published."""

    def __init__(self, rig, seconds, seed=None):
        self.truth, self.states, self.fixes, self.methods = [], [], [], set()
        runner = make_runner(rig, seed, [self.observe], journaled=False)
        runner.run(round(seconds * 1e9))
        runner.close()

    def observe(self, delivered, now_ns):
        match delivered.payload:
            case ReferenceState() as truth:
                self.truth.append((truth.stamp_ns, *truth.position_table_m))
            case VehicleState() as state:
                self.states.append((state.stamp_ns, *state.position_table_m))
            case StarFix() as fix:
                self.fixes.append((now_ns, fix.fix, fix.mode))
            case FusionStatus() as status:
                self.methods.add(status.method)

    def off_goal_m(self, goal, after_s):
        t, x, y = np.array(self.truth).T
        settled = t > after_s * 1e9
        return math.sqrt(np.mean((x[settled] - goal[0]) ** 2 + (y[settled] - goal[1]) ** 2))


def drawn(method):
    section = f'[mock_ups.standard.fusion]\nmethod = "{method}"\n\n'
    text = DRAWN.read_text().replace("[vehicles.alpha]", f"{section}[vehicles.alpha]", 1)
    return parse_rig(text, DRAWN)


@pytest.mark.slow
def test_the_joint_method_holds_the_station():
    seen = Seen(drawn("reintegration"), 60.0, 1)
    assert seen.methods == {"reintegration"}
    assert seen.off_goal_m((0.2, 0.1), 40.0) < 0.010


@pytest.mark.slow
def test_the_imu_alone_flies_off_in_a_minute_and_stars_alone_are_late():
    seen = Seen(drawn("imu"), 20.0, 1)
    assert seen.methods == {"imu"}
    t, x, y = np.array(seen.states).T
    true_t, true_x, true_y = np.array(seen.truth).T
    off = np.hypot(x - np.interp(t, true_t, true_x), y - np.interp(t, true_t, true_y))
    assert off[t < 8e9].max() < 0.01  # from the fixes of the rest
    assert 0.005 < off[-1] < 1.0  # a zero that is 0.1 to 5 mm/s^2 off, over 12 s
    seen = Seen(drawn("stars"), 12.0, 1)
    assert seen.methods == {"stars"}
    steps = np.flatnonzero(np.hypot(*np.diff(np.array(seen.states)[:, 1:], axis=0).T))
    assert 10 < len(steps) < 20  # it changes with each fix, and in no packet between


@pytest.mark.slow
def test_the_published_rig_flies_the_published_condition():
    rig = load_rig(RIGS / "published.toml")
    seen = Seen(rig, 60.0)
    arrivals = np.array([now_ns for now_ns, _, _ in seen.fixes]) * 1e-9
    is_fix = np.array([fix for _, fix, _ in seen.fixes])
    assert np.diff(arrivals) == pytest.approx(0.6, abs=0.01)
    assert 1 / 12 < 1.0 - is_fix.mean() < 1 / 3  # about one try in six
    assert {mode for _, fix, mode in seen.fixes if fix} == {"published"}
    assert 0.64 < np.diff(arrivals[is_fix]).mean() < 0.9
    assert np.diff(arrivals[is_fix]).max() < 3.7
    assert seen.methods == {"reintegration"}
    hold = rig.vehicles["alpha"].hold
    assert seen.off_goal_m((hold.x_m, hold.y_m), 40.0) < 0.05


def test_the_rig_of_our_methods_differs_in_the_methods_only():
    published, ours = (
        tomllib.loads((RIGS / f"{name}.toml").read_text()) for name in ("published", "published_condition")
    )
    camera = published["mock_ups"]["standard"]["star_camera"]
    assert (camera.pop("image"), camera.pop("identification")) == ("published", "published")
    assert set(camera.pop("published")) == {"level_ratio", "angle_limit_deg", "closeness_m"}
    assert published["mock_ups"]["standard"].pop("fusion") == {"method": "reintegration"}
    assert published.pop("name") != ours.pop("name")
    assert published == ours
