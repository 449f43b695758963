"""Carrying and correcting checkpoints: nothing given is changed, and the way does not depend on its cuts."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.fusion import error_state as es
from groundstation.fusion.checkpoint import Course
from groundstation.fusion.estimator import Counters, Fix
from groundstation.fusion.packet_history import PacketHistory


@pytest.fixture
def course(noise):
    history, rng = PacketHistory(), np.random.default_rng(3)
    for number in range(1, 301):
        rate, ax, ay = rng.normal(0.0, (0.2, 0.02, 0.02))
        history.rows.extend((0.01 * number, 0.01, rate, ax, ay, 0.0, 0.0))
    return Course(noise, None, history, Counters())


@pytest.fixture
def begun(course, fix_covariance):
    fix = Fix(10_000_000, 20_000_000, 0.3, -0.2, 0.5, fix_covariance)
    return course.begun(course.unknown(), fix, 0.01, 0.05)


def bits(checkpoint):
    return checkpoint.t_s, checkpoint.x.tobytes(), checkpoint.P.tobytes(), checkpoint.surface


def test_a_checkpoint_is_never_changed(course, begun, fix_covariance):
    before = bits(begun)
    later = course.carry(begun, 1.0)
    carried = bits(later)
    fixed = course.correct(later, Fix(0, 0, 0.31, -0.2, 0.6, fix_covariance))
    assert fixed.correction.nis < 1e3
    course.rested(begun, 0.0)
    course.state_at(begun, 2.0, 1.0)
    course.variance_in_time(begun, 0.3)
    assert bits(begun) == before
    assert bits(later) == carried
    assert fixed.checkpoint.t_s == later.t_s == 1.0


def test_a_way_in_two_parts_ends_where_the_whole_one_does(course, begun):
    course.rests.begin(1.2)
    course.rests.end(1.6)
    whole, half = course.carry(begun, 2.3), course.carry(begun, 1.4)
    parts = course.carry(half, 2.3)
    moving = slice(0, es.MOVING)
    np.testing.assert_allclose(parts.x[moving], whole.x[moving], atol=2e-4)
    assert np.linalg.eigvalsh(parts.P).min() > -1e-12
    np.testing.assert_allclose(course.state_at(begun, 2.3, 0.0)[es.THETA], whole.x[es.THETA], rtol=1e-9)


def test_standing_still_stops_the_motion_and_teaches_the_biases(course, noise, begun):
    course.rests.begin(0.0)
    rested = course.carry(replace(begun, x=begun.x.copy()), 3.0)
    assert not rested.x[es.VX : es.VY + 1].any()
    assert course._counters.by_name == {"rest_disturbed": 1}  # these packets are of a flight
    n = len(course.history)
    rows = np.frombuffer(course.history.rows).reshape(n, 7)
    rows[:, 2:5] = (0.01, 0.0, 0.0)
    quiet = course.carry(begun, 3.0)
    assert quiet.x[es.GYRO_BIAS] == pytest.approx(0.01, rel=1e-2)
    assert quiet.P[es.GYRO_BIAS, es.GYRO_BIAS] < 0.1 * begun.P[es.GYRO_BIAS, es.GYRO_BIAS]


def test_a_fix_outside_the_gate_leaves_state_and_covariance(course, begun, fix_covariance, noise):
    later = course.carry(begun, 1.0)
    far = course.correct(later, Fix(0, 0, 9.0, 9.0, 0.0, fix_covariance))
    assert far.correction.nis > noise.gate_nis
    assert bits(far.checkpoint) == bits(later)


def test_a_fix_that_agrees_makes_the_pose_more_certain(course, begun, fix_covariance):
    later = course.carry(begun, 1.0)
    at_it = Fix(0, 0, *(later.x[es.PX : es.PY + 1]), float(later.x[es.THETA]), fix_covariance)
    fixed = course.correct(later, at_it)
    assert fixed.checkpoint.P[es.PX, es.PX] < later.P[es.PX, es.PX]
    assert fixed.correction.K.shape == (len(later.x), 3)


def test_steps_are_written_down_only_when_asked_for(course, begun):
    steps = []
    with_steps, without = course.carry(begun, 1.0, steps), course.carry(begun, 1.0)
    assert len(steps) == 2
    assert with_steps.x.tobytes() == without.x.tobytes()
