"""Pictures laid on one another: those that overlap join, those that do not stay apart."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from calibration.sky.survey.linking import link
from calibration.sky.survey.overlap import Constellation, find_overlap
from calibration.sky.survey.tape import TapeError, fit_tape
from calibration.sky.survey.triangles import neighbour_triangles
from groundstation.frames import rigid_fit

GATE_M = 0.006
NOISE_M = 3e-4
HALF_VIEW_M = (1.15, 0.87)


def scatter(rng, count, width_m, height_m, apart_m=0.13):
    stars = []
    while len(stars) < count:
        at = rng.uniform((0.0, 0.0), (width_m, height_m))
        if all(np.hypot(*(at - s)) > apart_m for s in stars):
            stars.append(at)
    return np.array(stars) @ [1, 1j]


def picture(rng, stars, pose, stray=0):
    """What is seen from a pose, in body axes, in no order; and which star each spot is (-1: none)."""
    x, y, heading = pose
    q = (stars - complex(x, y)) * np.exp(-1j * heading)
    seen = np.flatnonzero((np.abs(q.real) < HALF_VIEW_M[0]) & (np.abs(q.imag) < HALF_VIEW_M[1]))
    q = q[seen] + NOISE_M * (rng.standard_normal(len(seen)) + 1j * rng.standard_normal(len(seen)))
    lights = rng.uniform(-1, 1, (stray, 2)) * HALF_VIEW_M @ [1, 1j]
    q, seen = np.concatenate((q, lights)), np.concatenate((seen, np.full(stray, -1)))
    order = rng.permutation(len(q))
    return q[order], seen[order]


def lawn(rng, x_m, y_m, step_m=0.4):
    poses, heading = [], 0.2
    for row, y in enumerate(np.arange(*y_m, 0.65)):
        xs = np.arange(*x_m, step_m)
        for x in xs if row % 2 == 0 else xs[::-1]:
            heading += rng.uniform(0.0, 0.4)
            poses.append((x, y, heading))
    return np.array(poses)


def pictures(rng, stars, poses, stray=0):
    made = [picture(rng, stars, pose, stray) for pose in poses]
    return [q for q, _ in made], [name for _, name in made]


def assert_names_are_right(one, names, seen_at_least=2):
    """Every star of the map that was seen often enough is one true star, and no true star is two."""
    true = np.concatenate([names[i] for i in one.placed])
    often = np.bincount(one.star, minlength=len(one.star_m)) >= seen_at_least
    owners = {}
    for star in np.flatnonzero(often):
        mine = set(true[one.star == star].tolist())
        assert len(mine) == 1
        owners.setdefault(mine.pop(), []).append(star)
    assert all(len(found) == 1 for found in owners.values())
    return owners


def test_a_sweep_becomes_one_map_with_every_star_once():
    rng = np.random.default_rng(1)
    stars = scatter(rng, 150, 5.0, 3.5)
    q, names = pictures(rng, stars, lawn(rng, (0.8, 4.3), (0.7, 2.9)))
    maps = link(q, GATE_M)
    assert [len(one.placed) for one in maps] == [len(q)]
    assert len(assert_names_are_right(maps[0], names)) > 130


def test_the_order_of_the_pictures_does_not_matter():
    rng = np.random.default_rng(2)
    stars = scatter(rng, 150, 5.0, 3.5)
    q, names = pictures(rng, stars, rng.permutation(lawn(rng, (0.8, 4.3), (0.7, 2.9))))
    maps = link(q, GATE_M)
    assert [len(one.placed) for one in maps] == [len(q)]
    assert_names_are_right(maps[0], names)


def test_stray_lights_in_every_picture_do_not_mislead():
    rng = np.random.default_rng(3)
    stars = scatter(rng, 150, 5.0, 3.5)
    q, names = pictures(rng, stars, lawn(rng, (0.8, 4.3), (0.7, 2.9)), stray=12)
    maps = link(q, GATE_M)
    assert len(maps[0].placed) == len(q)
    assert_names_are_right(maps[0], names, seen_at_least=3)


def test_pictures_of_another_ceiling_stay_apart():
    rng = np.random.default_rng(4)
    stars, others = scatter(rng, 150, 5.0, 3.5), scatter(rng, 150, 5.0, 3.5)
    poses = lawn(rng, (0.8, 4.3), (0.7, 2.9))
    strange = set(range(4, len(poses), 5))
    q = [picture(rng, others if i in strange else stars, pose)[0] for i, pose in enumerate(poses)]
    maps = link(q, GATE_M)
    for one in maps:
        kinds = {int(i) in strange for i in one.placed}
        assert len(kinds) == 1
    assert set(maps[0].placed.tolist()) == set(range(len(poses))) - strange


def test_a_gap_in_the_sweep_gives_two_maps_and_a_bridge_joins_them():
    rng = np.random.default_rng(5)
    stars = scatter(rng, 330, 11.0, 3.5)
    left, right = lawn(rng, (0.8, 3.2), (0.7, 2.9)), lawn(rng, (7.8, 10.2), (0.7, 2.9))
    q, _ = pictures(rng, stars, np.concatenate((left, right)))
    assert sorted(len(one.placed) for one in link(q, GATE_M)) == sorted((len(left), len(right)))
    bridge = np.array([(x, 1.6, 0.1 * x) for x in np.arange(3.2, 8.0, 0.5)])
    q, names = pictures(rng, stars, np.concatenate((left, right, bridge)))
    maps = link(q, GATE_M)
    assert [len(one.placed) for one in maps] == [len(q)]
    assert_names_are_right(maps[0], names)


def test_lights_in_rows_are_not_matched_one_row_off():
    rng = np.random.default_rng(6)
    grid = np.add.outer(1j * np.arange(0.1, 3.5, 0.3), np.arange(0.1, 5.0, 0.3)).ravel()
    stars = grid + 0.02 * (rng.standard_normal(len(grid)) + 1j * rng.standard_normal(len(grid)))
    q, names = pictures(rng, stars, lawn(rng, (0.8, 4.3), (0.7, 2.9)))
    for one in link(q, GATE_M):
        assert_names_are_right(one, names)


def test_a_perfect_grid_is_not_guessed_at():
    rng = np.random.default_rng(7)
    grid = np.add.outer(1j * np.arange(0.1, 3.5, 0.3), np.arange(0.1, 5.0, 0.3)).ravel()
    here, there = (picture(rng, grid, pose)[0] for pose in ((2.0, 1.6, 0.0), (2.6, 1.6, 0.2)))
    sky = [Constellation.of(q, np.zeros(1, complex)) for q in (here, there)]
    assert find_overlap(sky[0], sky[1], GATE_M, 1.1) is None


def test_random_lights_never_join():
    rng = np.random.default_rng(8)
    for _ in range(60):
        q = [rng.uniform(-1, 1, (int(rng.integers(5, 45)), 2)) * HALF_VIEW_M @ [1, 1j] for _ in range(2)]
        assert len(link(q, GATE_M)) == 2


def test_pictures_with_too_few_spots_are_left_out():
    rng = np.random.default_rng(9)
    stars = scatter(rng, 150, 5.0, 3.5)
    q, _ = pictures(rng, stars, lawn(rng, (0.8, 4.3), (0.7, 1.4)))
    q[0], q[3] = q[0][:2], np.zeros(0, complex)
    (only,) = link(q, GATE_M)
    assert only.placed.tolist() == [i for i in range(len(q)) if i not in (0, 3)]
    assert link([], GATE_M) == []


@settings(max_examples=30, deadline=None)
@given(st.floats(-3.1, 3.1), st.floats(-5, 5), st.floats(-5, 5))
def test_triangles_do_not_notice_a_rigid_motion(angle, x, y):
    q = scatter(np.random.default_rng(10), 30, 2.0, 2.0)
    moved = np.exp(1j * angle) * q + complex(x, y)
    before, after = (np.sort(neighbour_triangles(points).key_m, axis=0) for points in (q, moved))
    assert np.allclose(before, after, atol=1e-9)
    turn, shift = rigid_fit(q, moved)
    assert np.abs(turn * q + shift - moved).max() < 1e-9


def tape_case(scale=1.08, count=4):
    rng = np.random.default_rng(11)
    on_map = rng.uniform(0, 4, (count, 2)) @ [1, 1j]
    noise = 2e-3 * (rng.standard_normal(count) + 1j * rng.standard_normal(count))
    return on_map, scale * np.exp(0.7j) * on_map + (1 - 2j) + noise


def test_anchors_lay_the_map_on_the_table():
    on_map, tape = tape_case()
    fit = fit_tape(list("abcd"), on_map, tape, 3e-3)
    assert abs(fit.factor) == pytest.approx(1.08, rel=2e-3)
    assert fit.rms_m < 4e-3


def test_an_anchor_that_contradicts_the_others_is_named():
    on_map, tape = tape_case()
    tape[2] += 0.2
    with pytest.raises(TapeError, match=r"anchor 'c' lies 0\.2 m"):
        fit_tape(list("abcd"), on_map, tape, 3e-3)
    on_map, tape = tape_case(count=3)
    tape[1] += 0.1
    with pytest.raises(TapeError, match="contradict each other"):
        fit_tape(list("abc"), on_map, tape, 3e-3)


def test_mirrored_or_millimetre_anchors_are_refused():
    on_map, tape = tape_case()
    with pytest.raises(TapeError, match=r"times as far apart|contradict"):
        fit_tape(list("abcd"), on_map, np.conj(tape), 3e-3)
    with pytest.raises(TapeError, match="not metre"):
        fit_tape(list("abcd"), on_map, 1000 * tape, 3e-3)
    with pytest.raises(TapeError, match="one place"):
        fit_tape(list("ab"), np.ones(2, complex), tape[:2], 3e-3)
